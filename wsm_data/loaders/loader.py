"""The loader: batches of one rank in the order of the epoch, from where the state says, and a state to go on from."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

import torch.utils.data

from wsm_data.access.shard_reader import ShardReader
from wsm_data.errors import ConfigError
from wsm_data.loaders.batches.batch import Batch, BatchBlock
from wsm_data.loaders.batches.transfer import hand_over, open_transfer
from wsm_data.loaders.config import LoaderConfig, OrderConfig, SourceConfig
from wsm_data.loaders.ledger.writer import LedgerWriter
from wsm_data.loaders.order.epoch_order import EpochOrder, EpochSummary, rows_per_rank
from wsm_data.loaders.ranks import place_among_ranks
from wsm_data.loaders.reading.delivery import Delivery, deliver
from wsm_data.loaders.reading.step_reader import Delivered, StepReader
from wsm_data.loaders.sources.clips import Sources, open_sources, require_depth
from wsm_data.loaders.sources.state import loader_state, restore, state_to_json
from wsm_data.loaders.timing import Part, Timing

_CLOSED = -1
"""In place of the number of the process that a reader belongs to."""


class ClipLoader(torch.utils.data.IterableDataset[Batch]):
    """Batches of one rank. Iterating gives the rest of the current epoch, then the loader stands at the next one.

    An iterator starts when it is first advanced, so that one nobody advances changes nothing. There is one place, that
    of `state_dict`: when another iterator is started, or the place is changed, an older iterator raises RuntimeError.

    Within a worker of a torch DataLoader (`batch_size=None`), worker w of n gives the steps w, w + n, ... Workers have
    copies, and the loader in the training process never moves: its `state_dict` stays where it is (take that of
    torchdata's StatefulDataLoader), and without `set_epoch` before each pass every pass is of the same epoch. Only with
    `persistent_workers=True` do the copies live on, and move on by themselves.
    """

    def __init__(
        self,
        config: LoaderConfig | str | Path,
        *,
        batch: int | None = None,
        rank: int | None = None,
        world_size: int | None = None,
        sources: Sources | None = None,
    ):
        """Open the sources; no clip is read yet.

        Args:
            config: what is read, in which order, and how; or the path or URL of a release, whose clips of the split
                `train` are then read as the defaults of `LoaderConfig` say.
            batch: rows of one step over all ranks; only with a path or URL.
            rank: number of this rank; None: that of torch.distributed, 0 where it is not initialised.
            world_size: number of ranks; None: that of torch.distributed, 1 where it is not initialised.
            sources: what stands in for the sources of `config`, made from them, such as queries; None: the clips.

        Raises:
            ConfigError: the settings contradict themselves, the sources, or this machine.
            IntegrityError: a release is unfinished or damaged.
            ValueError: there is no such rank.
        """
        config = _settings(config, batch)
        self._config = config
        self._rank, self._world_size = place_among_ranks(rank, world_size)
        rows_per_rank(config.order, self._world_size)
        self._sources = open_sources(config.sources) if sources is None else sources
        manifest = self._sources.tables[0].release.manifest
        if config.depth:
            require_depth(self._sources)
        self._transfer = open_transfer(config.read, manifest, depth=config.depth)
        self.timing = Timing()
        self._reader = self._open_reader()
        self._process = os.getpid()
        self._template = loader_state(self._sources, config.order, epoch=0, step=0)
        self._ledger = self._open_ledger()
        self._epoch_order: EpochOrder | None = None
        self._epoch, self._step = 0, 0
        self._turn = 0
        self._running: Delivery[Any] | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Cross to another process as settings and a place; what is open stays here."""
        return _reopened, (self._config, self._rank, self._world_size, self._sources, self.state_dict())

    def __len__(self) -> int:
        """Steps of the current epoch, as `steps`."""
        return self.steps

    @property
    def sources(self) -> Sources:
        """The clips, by their refs."""
        return self._sources

    @property
    def epoch_order(self) -> EpochOrder:
        """The order of the current epoch.

        Raises:
            ConfigError: the epoch has no step, or a clip does not fit into a row.
        """
        if self._epoch_order is None or self._epoch_order.epoch != self._epoch:
            self._epoch_order = None  # its memory is free before the next one takes as much
            self._epoch_order = self._sources.order_epoch(self._config.order, self._epoch)
        return self._epoch_order

    @property
    def steps(self) -> int:
        """Global steps of the current epoch, the same on every rank."""
        return self.epoch_order.steps

    @property
    def summary(self) -> EpochSummary:
        """What becomes of the clips in the current epoch."""
        return self.epoch_order.summary

    def state_dict(self) -> dict[str, Any]:
        """The place behind the last batch that was delivered, as JSON; what was read ahead does not count."""
        return state_to_json(replace(self._template, epoch=self._epoch, step=self._step))

    def load_state_dict(self, state_dict: Mapping[str, Any]) -> None:
        """Go on from a place, on as many ranks or threads as there are now.

        Raises:
            ConfigError: the state is of other sources or another order; the message says field by field.
        """
        epoch, step = restore(state_dict, self._template)
        self._move_to(epoch, step)
        if step > self.steps:
            raise ConfigError(f"epoch {epoch} has {self.steps} steps, but the state stands at step {step}; restore it")

    def set_epoch(self, epoch: int) -> None:
        """Go to the start of an epoch; nothing where the loader is in it already.

        Raises:
            ValueError: the number is negative.
        """
        if epoch < 0:
            raise ValueError(f"epoch must be at least 0, found {epoch}")
        if epoch != self._epoch:
            self._move_to(epoch, 0)

    def __iter__(self) -> Iterator[Batch]:
        return self.completed(lambda batch, _: batch, lambda batch: batch)

    def completed(
        self,
        complete: Callable[[Batch, Sequence[ShardReader]], Delivered],
        batch_of: Callable[[Delivered], Batch],
    ) -> Iterator[Delivered]:
        """Iterate over what is made of each batch where it is read; only then does its step count as delivered.

        Args:
            complete: makes it of a batch, with the readers of the sources' shards; called in the threads that read.
            batch_of: the batch that something was made of.
        """
        self._turn += 1
        turn, delivery, is_over = self._turn, self._start(complete), False
        try:
            while (delivered := self._deliver(turn, delivery, batch_of)) is not None:
                yield delivered
                del delivered  # its memory is free as soon as the caller lets go of it
            is_over = True
        finally:
            if not is_over and turn == self._turn:  # an error of a step, an interrupt, or the caller breaks off
                self._stop()
        delivery.close()
        self._running = None
        self._epoch, self._step = self._epoch + 1, 0

    def close(self) -> None:
        """End all threads, close the files and the ledger. A later iterator opens them again.

        What a store is being asked is given up, not waited for.
        """
        self._turn += 1
        self._stop()
        self._close_reader()
        if self._ledger is not None:
            self._ledger.close()

    def __enter__(self) -> "ClipLoader":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _start(self, complete: Callable[[Batch, Sequence[ShardReader]], Delivered]) -> Delivery[Delivered]:
        """Begin to deliver from the current place; an older iterator stops reading."""
        self._stop()
        if self._process != os.getpid():  # closed, or of another process: a fork takes neither threads nor connections
            self._reader, self._process = self._open_reader(), os.getpid()
        transfer, readers = self._transfer, self._reader.readers

        def finish(block: BatchBlock) -> Delivered:
            return complete(transfer(block), readers)

        worker = torch.utils.data.get_worker_info()
        first, stride = (0, 1) if worker is None else (worker.id, worker.num_workers)
        if worker is not None:
            _require_fit_for_worker(self._config)
        steps = range(self._step + (first - self._step) % stride, self.steps, stride)
        if self._ledger is not None:
            self._ledger.begin(self._epoch, self._step, self.steps)
        delivery = deliver(self._reader, finish, self.epoch_order, steps, self._config.read, inline=worker is not None)
        self._running = delivery
        return delivery

    def _deliver(
        self, turn: int, delivery: Delivery[Delivered], batch_of: Callable[[Delivered], Batch]
    ) -> Delivered | None:
        """What comes next, counted and recorded; None where the epoch is over."""
        if turn != self._turn:
            raise RuntimeError(
                "this iterator was overtaken: another one was started since, or the loader was moved or closed; a "
                "loader has one place, so advance the newest iterator only"
            )
        with self.timing.measure(Part.WAIT):
            delivered = next(delivery, None)
        if delivered is None:
            return None
        batch = batch_of(delivered)
        if self._ledger is not None:
            self._ledger.record(batch.epoch, batch.step, batch.refs)
        self._step = batch.step + 1
        hand_over(batch)
        return delivered

    def _move_to(self, epoch: int, step: int) -> None:
        self._turn += 1
        self._stop()
        self._epoch, self._step = epoch, step

    def _stop(self) -> None:
        """Drop what is read ahead. Where it comes from a store, that is told first: no thread waits for its answer."""
        if self._running is not None:
            if self._reader.asks_stores:
                self._close_reader()
            self._running.close()
            self._running = None

    def _close_reader(self) -> None:
        """The next iterator opens another one."""
        self._reader.close()
        self._process = _CLOSED

    def _open_reader(self) -> StepReader:
        return StepReader(
            self._sources,
            self._config.read,
            self.timing,
            rank=self._rank,
            world_size=self._world_size,
            depth=self._config.depth,
        )

    def _open_ledger(self) -> LedgerWriter | None:
        identity = {"sources": self._template.sources, "order": self._template.order}
        folder = self._config.ledger
        return LedgerWriter(folder, identity, self._rank, self._world_size) if folder else None


def _settings(config: LoaderConfig | str | Path, batch: int | None) -> LoaderConfig:
    """The settings that were given, or those of the release at a place."""
    if isinstance(config, LoaderConfig):
        if batch is not None:
            raise ConfigError("batch goes with the path of a release; in a LoaderConfig it is order.global_batch")
        return config
    order = OrderConfig() if batch is None else OrderConfig(global_batch=batch)
    return LoaderConfig(sources=(SourceConfig(release=str(config)),), order=order)


def _require_fit_for_worker(config: LoaderConfig) -> None:
    """What only the training process can do must not be asked of a worker of somebody else's DataLoader."""
    asked = {"ledger": config.ledger, "pin_memory": config.read.pin_memory}
    if any(asked.values()) or config.read.device != "cpu":
        names = [name for name, value in asked.items() if value] + ["device"] * (config.read.device != "cpu")
        raise ConfigError(
            f"a loader inside a DataLoader worker must leave these settings out, found {', '.join(names)}; iterate the "
            "loader itself, which reads ahead with threads, or leave them out"
        )


def _reopened(
    config: LoaderConfig, rank: int, world_size: int, sources: Sources, state: Mapping[str, Any]
) -> ClipLoader:
    loader = ClipLoader(config, rank=rank, world_size=world_size, sources=sources)
    loader.load_state_dict(state)
    return loader
