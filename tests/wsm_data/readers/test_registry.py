from dataclasses import replace

import pytest

from wsm_data.errors import ConfigError
from wsm_data.readers.interndata.reader import INTERNDATA
from wsm_data.readers.registry import READERS, source_reader


def test_a_manifest_that_names_no_reader_means_interndata(dataset):
    assert source_reader(dataset).name == INTERNDATA.name


def test_every_reader_is_found_by_its_own_name(dataset):
    assert [source_reader(replace(dataset, reader=reader.name)) for reader in READERS] == list(READERS)


def test_an_unknown_reader_is_refused_with_the_nearest_name(dataset):
    with pytest.raises(ConfigError, match=r"'tiny' names the reader 'internadata', .*interndata"):
        source_reader(replace(dataset, reader="internadata"))
