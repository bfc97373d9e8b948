# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""All that the crank messages of one source set off, in one call of machine code."""

import math
from typing import Callable, Dict, Iterable, List, NamedTuple, Optional

import numpy as np

from .joint_state_reader import Source
from .mechanism_publisher import Moved
from .message_layout import Wire
from ..formula import llvm_pipeline as native


def is_ready() -> bool:
    """Return whether there is the machine code; if not, it is being made."""
    return native.code().done()


class Whole(NamedTuple):
    """
    The joints of the whole scene.

    Attributes
    ----------
    wire : Wire
        What is sent.
    values : list of float arrays
        From which, one after the other, it is made.
    send : callable
        From a stamp: shows them in the usual way, without what cannot be assembled.

    """

    wire: Wire
    values: List[np.ndarray]
    send: Callable[[bytes], None]


class Tick:
    """
    All that the messages of one source set off.

    Parameters
    ----------
    source : Source
        How its messages are told from others.
    moved : list of Moved
        What they move.
    whole : Whole, optional
        The joints of the whole scene, where they are listened to.
    now : callable
        Returns the time, packed, for messages that have none.
    stamp : int64 array (2,)
        Where the stamp of the last message is kept; ticks of several sources may share it.

    Attributes
    ----------
    moved : list of Moved
        The same.

    """

    def __init__(self, source: Source, moved: List[Moved], whole: Optional[Whole], now,
                 stamp: np.ndarray):
        self.moved = moved
        self._solved = [part for part in moved if part.solution]
        # The first message is shown in the usual way: what is drawn may be something else.
        self._whole, self._now = whole, now
        self._failed = frozenset(part.shown for part in self._solved)
        self._stamp = stamp
        at = native.address(stamp)
        tables = {id(part): _tables(source, part, at) for part in moved}
        parts, solved = ([tables[id(part)] for part in some] for some in (moved, self._solved))
        whole_puts = [_puts(whole.wire, whole.values, at)] if whole else []
        self._pipeline = native.Pipeline(
            *(number.to_bytes(source.size, 'little') for number in (source.same, source.mask)),
            stamp, (source, moved, whole),
            takes=_joined(native.TAKE, (part['takes'] for part in parts)),
            loops=_joined(native.LOOP, (part['loops'] for part in solved)),
            limits=_joined(native.LIMIT, map(_numbered, range(len(solved)), solved)),
            changes=_joined(native.CHANGE, (part['changes'] for part in solved)),
            puts=_joined(native.PUT, [*(part['puts'] for part in solved), *whole_puts]))
        wires = [wire for part in moved for wire in part.wires] + ([whole.wire] if whole else [])
        self._sent = [(wire.publisher.publish, wire.template.message) for wire in wires]

    def run(self, text: bytes) -> bool:
        """Return whether a message is of this source; if so, show what it says."""
        failed = self._pipeline.run(text, len(text))
        if failed == native.UNSTAMPED:
            self._stamp[1:] = np.frombuffer(self._now(), np.int64)
            failed = self._pipeline.run(text, len(text))
            self._stamp[1] = 0
        if failed < 0:
            return False
        if failed or self._failed:
            self._show_each()
        else:
            for publish, message in self._sent:
                publish(message.tobytes())
        return True

    def _show_each(self):
        """Show what cannot be assembled, or could not be the last time, in the usual way."""
        failed = {part.shown for part, wrong in zip(self._solved, self._pipeline.failed) if wrong}
        stamp = self._stamp[:1].tobytes()
        for part in self._solved:
            if part.shown in failed | self._failed:
                part.shown.forget(stamp)
                part.shown.show()
            else:
                for wire in part.wires:
                    wire.send_patched()
        if self._whole and failed:
            self._whole.send(stamp)
        elif self._whole:
            self._whole.wire.send_patched()
        self._failed = failed


def _tables(source: Source, part: Moved, stamp: int) -> Dict[str, np.ndarray]:
    """Return what is done with a mechanism; made once for it and a source."""
    if not part.made or part.made[0] is not source:
        tables = {'takes': np.array([*_takes(source, part)], native.TAKE)}
        if solution := part.solution:
            code = *solution.batch.code, solution.values.size
            tables.update(
                loops=np.array([code], native.LOOP), changes=_changes(part),
                limits=np.array([*_limits(part)], native.LIMIT),
                puts=_joined(native.PUT, (_puts(wire, [solution.values], stamp)
                                          for wire in part.wires)))
        part.made = source, tables
    return part.made[1]


def _numbered(i: int, tables: Dict[str, np.ndarray]) -> np.ndarray:
    """Return the limits of a loop of that number."""
    limits = tables['limits']
    limits['loop'] = i
    return limits


def _takes(source: Source, part: Moved):
    """Yield what is taken of a message: an input goes to each leg, and is kept."""
    told, n, solution = native.addresses(part.told), part.told.shape[1], part.solution
    given = solution and native.addresses(solution.batch.given)
    driven = solution and native.addresses(solution.layout.driven(solution.values))
    for drive, i, place in part.places:
        rows = [(source.positions, 0, i, (drive.ratio, -0.0 if drive.is_plain else drive.offset))]
        if part.moving:
            rows.append((source.velocities, 1, n + i, (drive.ratio, -0.0)))
        for start, row, k, change in rows:
            to = [told[row, i]]
            if solution and k < len(driven):
                to += [*given[k], driven[k]]
            for at in to:
                yield start + 8 * place, at, *change


def _limits(part: Moved):
    """Yield for each leg between what it can be assembled, well within its widest reach."""
    assembly = part.assembly
    if not assembly.is_limited:
        return
    first, (low, high) = assembly.linkage.inputs[0], max(
        assembly.reach, key=lambda arc: arc[1] - arc[0])
    for at, (factor, plus) in zip(native.addresses(part.solution.batch.given)[0],
                                  assembly.own_inputs()):
        yield (0, at, factor, plus, 0.5 * (low + high), 0.5 * (high - low),
               math.tau if first.turns else 0.0)


def _changes(part: Moved) -> np.ndarray:
    rows = np.zeros(part.solution.values.size if part.changes else 0, native.CHANGE)
    if part.changes:
        rows['at'] = native.addresses(part.solution.values)
        rows['factor'], rows['plus'], taken = part.changes
        rows['turn'][taken] = math.tau
    return rows


def _puts(wire: Wire, arrays: List[np.ndarray], stamp: int) -> np.ndarray:
    """Return what is put into a message: of the values of some arrays, one after the other."""
    numbers, sources, stamps = wire.template.places()
    values = np.concatenate([native.addresses(values) for values in arrays])
    rows = np.empty(len(numbers) + len(stamps), native.PUT)
    rows['from'] = np.append(values[sources], np.full(len(stamps), stamp))
    rows['to'] = np.append(numbers, stamps)
    return rows


def _joined(kind: np.dtype, tables: Iterable[np.ndarray]) -> np.ndarray:
    # As bytes: numpy compares the types of all tables, field by field.
    return np.frombuffer(b''.join(tables), kind)
