"""Whether the claims of the local matrix's paper hold here is computed from the rows that were measured [Shcherbakov19]."""

from __future__ import annotations

from app.bench.papers.kahl_verdicts import find, holds
from app.bench.papers.published import SHCHERBAKOV_LOCAL
from app.bench.speed.rank_one import PAIR
from app.util.tables import Row

SEVERAL = ("inverse", "series")  # the ways that keep a matrix of several reflections
HALF = 0.5  # of the bandwidth of a copy
FRAGMENTS = 0.75  # of an update's milliseconds, from which on its fragments are what bounds it


def verdicts(rows: list[Row]) -> list[str]:
    """A line for each claim that the rows can judge."""
    judged = [outperforms(rows, "lit_ms", ""), outperforms(rows, "frame_ms", ", with a swap in each frame")]
    judged += [differs(rows), updates(rows), pays(rows)]
    return [line for line in judged if line is not None]


def outperforms(rows: list[Row], key: str, when: str) -> str | None:
    """At each size, each way to keep several reflections beside plain radiosity."""
    better, worse, listed = list[str](), list[str](), list[str]()
    for plain in find_sized(rows, "iterate"):
        for bounces in SEVERAL:
            for row in find(find_sized(rows, bounces), size=plain["size"]):
                name = f"{row['size']:,} {bounces}"
                (better if row[key] < plain[key] else worse).append(name)
                listed.append(f"{name} {row[key]:.2f} ms for {plain[key]:.2f}")
    if not listed:
        return None
    claim = f"The matrix of several reflections outperforms plain radiosity on the local set{when}"
    if better and worse:
        return (
            f"{claim}: holds here at {', '.join(better)}, does not hold here at {', '.join(worse)}: {'; '.join(listed)}"
        )
    return holds(claim, not worse, "; ".join(listed))


def find_sized(rows: list[Row], bounces: str) -> list[Row]:
    """Rows of local sets that bounce so."""
    return [row for row in rows if row.get("size") is not None and row["bounces"] == bounces]


def differs(rows: list[Row]) -> str | None:
    """The mean difference of pixels of all that walked."""
    limit = SHCHERBAKOV_LOCAL.difference
    walked = [row for row in rows if row.get("picture") is not None]
    if not walked or limit is None:
        return None
    over = [row for row in walked if row["picture"] >= limit]
    listed = "; ".join(f"{row['size']:,} {row['bounces']} {row['picture']:.4f}" for row in walked)
    return holds(f"Pictures differ by less than {limit:g} on average", not over, f"pixels differ by {listed}")


def updates(rows: list[Row]) -> str | None:
    """At each size an update of rank one against a copy of as many bytes, and against its fragments: a constant colour, and what
    two vectors add where more of them wait."""
    measured = [row for row in rows if row.get("update_ms") is not None]
    if not measured:
        return None
    good, listed = True, list[str]()
    for row in measured:
        copy = row["copy_ms"] / row["update_ms"]
        fragments = (row["constant_ms"] + PAIR * row["vector_ms"]) / row["update_ms"]
        bound = "memory" if copy >= HALF else "fragments" if fragments >= FRAGMENTS else "neither"
        good = good and bound != "neither"
        listed.append(
            f"{row['size']:,}: {copy:.0%} of the bandwidth of a copy, a constant colour and two vectors are {fragments:.0%} of "
            f"its time, so {bound} bound{'s' if bound != 'fragments' else ''} it"
        )
    claim = f"Updates of rank one run at {HALF:.0%} of the bandwidth of a copy, or fragments bound them"
    return holds(claim, good, "; ".join(listed))


def pays(rows: list[Row]) -> str | None:
    """From how many patches of the world on it is faster to light a local set than all patches, if that takes a time in
    proportion to them."""
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
