"""Whether the claims of the local matrix's paper hold here is computed from the rows that were measured [Shcherbakov19]."""

from __future__ import annotations

from app.bench.papers.kahl_verdicts import ALIKE, find, holds
from app.bench.papers.published import SHCHERBAKOV_LOCAL
from app.bench.speed.rank_one import PAIR
from app.util.tables import Row

SEVERAL = ("inverse", "series")  # the ways that keep a matrix of several reflections
NOTHING = "and nothing that was measured bounds it"
HALF = 0.5  # of the bandwidth of a copy; less of it is not what bounds


def verdicts(rows: list[Row]) -> list[str]:
    """Each claim that the rows can judge has a line."""
    judged = [outperforms(rows, "lit_ms", ""), outperforms(rows, "frame_ms", ", with a swap in each frame")]
    judged += [differs(rows), updates(rows), pays(rows)]
    return [line for line in judged if line is not None]


def outperforms(rows: list[Row], key: str, when: str) -> str | None:
    """At each size each way to keep several reflections stands beside plain radiosity."""
    found: dict[str, list[str]] = {"holds": [], "is undecided": [], "does not hold": []}
    for plain in find_sized(rows, "iterate"):
        for bounces in SEVERAL:
            for row in find(find_sized(rows, bounces), size=plain["size"]):
                mine, theirs = row[key], plain[key]
                right = ALIKE * mine <= theirs
                verdict = "holds" if right else "does not hold" if mine >= ALIKE * theirs else "is undecided"
                found[verdict].append(f"{row['size']:,} {bounces} {mine:.2f} ms for {theirs:.2f}")
    claim = f"The matrix of several reflections outperforms plain radiosity on the local set{when}"
    judged = [f"{verdict} here, because {'; '.join(listed)}" for verdict, listed in found.items() if listed]
    return f"{claim}: {'. It '.join(judged)}" if judged else None


def find_sized(rows: list[Row], bounces: str) -> list[Row]:
    """The rows of local sets that bounce so are found."""
    return [row for row in rows if row.get("size") is not None and row["bounces"] == bounces]


def differs(rows: list[Row]) -> str | None:
    """The mean difference of pixels is judged in all rows that walked."""
    limit = SHCHERBAKOV_LOCAL.difference
    walked = [row for row in rows if row.get("picture") is not None]
    if not walked or limit is None:
        return None
    over = [row for row in walked if row["picture"] >= limit]
    listed = "; ".join(f"{row['size']:,} {row['bounces']} {row['picture']:.4f}" for row in walked)
    return holds(f"Pictures differ by less than {limit:g} on average", not over, f"pixels differ by {listed}")


def updates(rows: list[Row]) -> str | None:
    """At each size an update of rank one is bound by memory, or by its fragments."""
    measured = [row for row in rows if row.get("update_ms") is not None]
    if not measured:
        return None
    bounds = [bound(row) for row in measured]
    listed = "; ".join(
        f"{row['size']:,}: {row['copy_ms'] / row['update_ms']:.0%} of the bandwidth of a copy, {text}"
        for row, text in zip(measured, bounds, strict=True)
    )
    claim = f"Updates of rank one run at {HALF:.0%} of the bandwidth of a copy, or fragments bound them"
    return holds(claim, NOTHING not in bounds, listed)


def bound(row: Row) -> str:
    """An update is bound by memory if a copy of as many bytes takes half as long or more. If not, a constant colour blended over
    the same triangle has the same bytes: where it is fast, the rest is what fragments compute; where it is slow beside a copy,
    fragments are slow whatever they compute."""
    update, constant = row["update_ms"], row["constant_ms"]
    if row["copy_ms"] >= HALF * update:
        return "which bounds it"
    if constant < HALF * update:
        vectors = PAIR * row["vector_ms"] / update
        return (
            f"but what its fragments compute bounds it: the same bytes in a constant colour take {constant / update:.0%} of its "
            f"time, to read two vectors {vectors:.0%}"
        )
    if row["copy_ms"] < HALF * constant:
        return f"but fragments bound it: a constant colour takes {constant / update:.0%} of its time"
    return NOTHING


def pays(rows: list[Row]) -> str | None:
    """A line says from how many patches of the world on it is faster to light a local set than all patches, if that takes a time
    in proportion to them."""
    whole = [row for row in rows if row.get("size") is None and row.get("light_ms") is not None]
    sized = [row for bounces in (*SEVERAL, "iterate") for row in find_sized(rows, bounces)]
    if not whole or not sized:
        return None
    each = whole[0]["light_ms"] / whole[0]["patches"]
    listed = "; ".join(
        f"{row['size']:,} {row['bounces']}: {row['light_ms'] / each:,.0f} and {row['step_ms'] / each:,.0f}"
        for row in sorted(sized, key=lambda row: int(row["size"]))
    )
    return (
        f"All {whole[0]['patches']:,} patches by kept hits are lit anew in {whole[0]['light_ms']:.0f} ms, "
        f"{1e3 * each:.2f} µs for each: lighting a local set, and a step of the walk, pay in worlds of more patches than {listed}"
    )
