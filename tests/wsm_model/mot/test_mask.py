"""The mask against the table of the specification, written out once more as plain conditions."""

import pytest
import torch

from wsm_data.schema.sequence import SequenceSpan, frame_table
from wsm_model.config import Expert, Variant
from wsm_model.mot.mask import TokenKind, dense_mask, token_table


def may_attend(query: tuple[str, int, int], key: tuple[str, int, int], variant: Variant) -> bool:
    """One cell of the table: (kind, latent, chunk) of query and key."""
    (q_kind, i, n), (k_kind, j, m) = query, key
    if q_kind in ("clean rgb", "clean state"):
        return k_kind == q_kind and j <= i
    if q_kind == "noisy rgb":
        if k_kind == "clean rgb":
            return m < n
        if k_kind == "clean state":
            return m < n and variant is Variant.SLAM
        return k_kind == "noisy rgb" and m == n
    if k_kind == "clean rgb":
        return m <= n
    if k_kind == "clean state":
        return m < n
    return k_kind == "state query" and m == n


NAMES = {
    TokenKind.CLEAN_RGB: "clean rgb",
    TokenKind.CLEAN_STATE: "clean state",
    TokenKind.NOISY_RGB: "noisy rgb",
    TokenKind.STATE_QUERY: "state query",
}


def chunk_of(latent: int, chunk_size: int) -> int:
    """The anchor is chunk 0; K latents make up each later one."""
    return 0 if latent == 0 else 1 + (latent - 1) // chunk_size


@pytest.mark.parametrize("variant", Variant)
@pytest.mark.parametrize("chunk_size", [1, 2, 3, 4])
def test_every_pair_of_tokens_follows_the_table(make_model, chunk_size, variant):
    frames, config = 6, make_model(variant).config
    table = frame_table([SequenceSpan(row=0, start=0, length=frames, chunk_size=chunk_size)], 1, frames)
    mask = dense_mask(config, table)[0]
    tokens = token_table(config, frames)
    described = [
        (NAMES[TokenKind(kind)], frame, chunk_of(frame, chunk_size))
        for kind, frame in zip(tokens.kind.tolist(), tokens.frame.tolist(), strict=True)
    ]
    wanted = [[may_attend(query, key, variant) for key in described] for query in described]
    assert torch.equal(mask, torch.tensor(wanted))


def test_without_slam_dreams_do_not_see_the_poses_issued_before(make_model):
    idm = make_model(Variant.IDM).config
    table = frame_table([SequenceSpan(row=0, start=0, length=5, chunk_size=2)], 1, 5)
    mask, tokens = dense_mask(idm, table)[0], token_table(idm, 5)
    noisy, states = tokens.kind == TokenKind.NOISY_RGB, tokens.kind == TokenKind.CLEAN_STATE
    assert not mask[noisy][:, states].any()
    assert mask[tokens.kind == TokenKind.STATE_QUERY][:, states].any()
    assert Expert.DEPTH not in idm.experts


def test_sequences_packed_into_one_row_do_not_see_one_another(config):
    spans = [
        SequenceSpan(row=0, start=0, length=3, chunk_size=2),
        SequenceSpan(row=0, start=3, length=4, chunk_size=2),
    ]
    mask, tokens = dense_mask(config, frame_table(spans, 1, 7))[0], token_table(config, 7)
    first = tokens.frame < 3
    assert not mask[first][:, ~first].any()
    assert not mask[~first][:, first].any()


def test_padding_sees_itself_alone_and_is_seen_by_nothing_else(config):
    table = frame_table([SequenceSpan(row=0, start=0, length=3, chunk_size=2)], 1, 5)
    mask, padding = dense_mask(config, table)[0], token_table(config, 5).frame >= 3
    assert torch.equal(mask[padding][:, padding], torch.eye(int(padding.sum()), dtype=torch.bool))
    assert not mask[padding][:, ~padding].any()
    assert not mask[~padding][:, padding].any()
