import numpy as np
import pytest

from wsm_data.synth.home.furniture import storage
from wsm_data.synth.render.surface import Texture


def test_storage_stands_on_its_footprint(style, stands_on_its_footprint):
    rng = np.random.default_rng(0)
    for item in (
        storage.bookshelf(rng, style, 1.0, 2.0),
        storage.wardrobe(rng, style, 1.5),
        storage.chest(rng, style, 1.0, 0.8),
        storage.television(rng, style),
        storage.coat_rack(rng, style),
    ):
        stands_on_its_footprint(item)


def test_a_bookshelf_holds_books_within_its_boards(style):
    shelf = storage.bookshelf(np.random.default_rng(0), style, 1.2, 2.0)
    books = shelf.surface.points_m[shelf.surface.texture == Texture.BOOK]
    assert len(books) > 100
    assert np.abs(books[..., 0]).max() < 0.6
    assert books[..., 1].min() > 0
    assert books[..., 1].max() < 0.3
    assert books[..., 2].max() < 2.0


def test_a_wardrobe_is_as_wide_as_asked_for(style):
    x = storage.wardrobe(np.random.default_rng(0), style, 1.5).surface.points_m[..., 0]
    assert x.max() - x.min() == pytest.approx(1.54, abs=0.01)
