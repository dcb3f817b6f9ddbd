"""What is asked of Slurm for the jobs of a run. Light: the command line builds it."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class SlurmConfig:
    """What each job asks for; what is empty or 0 is left to the site, and to sbatch's own variables.

    Attributes:
        partition: partition of the jobs.
        account: account that is charged.
        time_min: time limit of a job, minutes.
        cpus: CPUs of a job; a worker computes on one.
        gpus: GPUs of a job, on which its worker loads a codec of its own.
        memory_gb: memory of a job, GB; 0 for what the site gives.
        attempts: how often a task is submitted whose job was killed, timed out or was lost with its node.
        max_jobs: jobs of one array; a site allows about a thousand (MaxArraySize). Tasks beyond it share jobs.
    """

    partition: str = ""
    account: str = ""
    time_min: int = 24 * 60
    cpus: int = 1
    gpus: int = 0
    memory_gb: int = 0
    attempts: int = 3
    max_jobs: int = 1000

    def __post_init__(self) -> None:
        for name in ("time_min", "cpus", "attempts", "max_jobs"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, found {getattr(self, name)}")
        for name in ("gpus", "memory_gb"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must not be negative, found {getattr(self, name)}")

    def parameters(self) -> dict[str, object]:
        """As submitit's executor for Slurm takes them; what is left to the site is left out."""
        given = {
            "slurm_partition": self.partition,
            "slurm_account": self.account,
            "slurm_gpus_per_node": self.gpus,
            "slurm_mem": f"{self.memory_gb}GB" if self.memory_gb else "",
        }
        return {name: value for name, value in given.items() if value}
