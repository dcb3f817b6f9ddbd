"""docs/settings.md is what `wsm settings --markdown` prints."""

from pathlib import Path

from pipelines.operations.settings import markdown_page, settings_by_command

PAGE = Path(__file__).parents[2] / "docs/settings.md"


def test_the_page_of_settings_is_what_the_command_writes():
    written = markdown_page(settings_by_command())
    assert PAGE.read_text() == written, "run: wsm settings --markdown > docs/settings.md"
