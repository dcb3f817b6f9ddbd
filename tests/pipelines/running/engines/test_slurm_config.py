import pytest

from pipelines.running.engines.slurm_config import SlurmConfig


def test_what_is_left_to_the_site_is_not_asked_for():
    assert SlurmConfig().parameters() == {}
    asked = SlurmConfig(partition="gpu", account="us", gpus=2, memory_gb=8).parameters()
    assert asked == {
        "slurm_partition": "gpu",
        "slurm_account": "us",
        "slurm_gpus_per_node": 2,
        "slurm_mem": "8GB",
    }


@pytest.mark.parametrize("wrong", [{"time_min": 0}, {"attempts": 0}, {"gpus": -1}])
def test_what_no_job_can_ask_for_is_refused(wrong):
    with pytest.raises(ValueError, match="must"):
        SlurmConfig(**wrong)
