"""Whether Kahl's conclusions hold here is computed from the rows that were measured [Kahl22]."""

from __future__ import annotations

from app.util.tables import Row

BALANCED = 128  # windows along the edge of a lightmap that he calls balanced
ALIKE = 1.1  # errors up to this ratio are alike
MUCH = 2.0  # times as fast
BOUNCES = 7  # of a solve down to 1 %, over which what is found once is spread
SAMPLED = ("stride", "monte-carlo", "mipmapped")


def verdicts(rows: list[Row]) -> list[str]:
    """A line for each conclusion that the rows can judge."""
    judged = balance(rows), artefacts(rows), voxels(rows), kept(rows), quadtree(rows), directional(rows)
    return [line for line in judged if line is not None]


def holds(claim: str, right: bool, why: str) -> str:
    return f"{claim}: {'holds here' if right else 'does not hold here'}, because {why}"


def find(rows: list[Row], **wanted: object) -> list[Row]:
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]


def balance(rows: list[Row]) -> str | None:
    """The largest window whose error is like that of the smallest that was measured, of all modes."""
    widest, finest = [], []
    for size in dict.fromkeys(row["size"] for row in rows):
        for mode in SAMPLED:
            line = find(rows, size=size, occlusion="rays", senders=mode)
            line += find(rows, size=size, occlusion="rays", senders="all")  # windows of one texel
            if len(line) < 2:
                continue
            line.sort(key=lambda row: int(row["window"]))
            alike = [row for row in line if row["rms"] <= ALIKE * line[0]["rms"]]
            widest.append((size / alike[-1]["window"], f"{size}² {mode}: {alike[-1]['window']}"))
            finest.append(size / line[0]["window"])
    if not widest:
        return None
    enough, most = max(widest)[0], max(finest)
    if enough < BALANCED <= most:
        right, why = "does not hold here", f"no more than {enough:.0f}² windows are needed"
    elif enough < most:
        right, why = "does not hold here", f"{enough:.0f}² windows do as well as {most:.0f}²"
    elif most < BALANCED:
        right, why = "is not refuted here", f"no row has {BALANCED}² windows; of up to {most:.0f}², more are better"
    else:
        right, why = "holds here", f"up to {most:.0f}² windows, more of them are better"
    listed = "; ".join(text for _, text in widest)
    claim = f"A window of 1/{BALANCED} of the lightmap is balanced"
    return (
        f"{claim}: {right}, because {why}; widest windows within {ALIKE - 1:.0%} of the RMS of the narrowest: {listed}"
    )


def artefacts(rows: list[Row]) -> str | None:
    """Errors of cells of the three ways to take less than all, at each size and window."""
    right, listed = True, []
    for size, window in dict.fromkeys((row["size"], row["window"]) for row in rows):
        three = {m: find(rows, size=size, window=window, senders=m, occlusion="rays") for m in SAMPLED}
        if not all(three.values()):
            continue
        errors = {mode: float(found[0]["even"]) for mode, found in three.items()}
        right = right and errors["monte-carlo"] <= min(errors.values())
        listed.append(f"{size}² / {window}: " + ", ".join(f"{mode} {error:.1%}" for mode, error in errors.items()))
    if not listed:
        return None
    return holds("Monte Carlo has the fewest artefacts", right, f"errors of cells are {'; '.join(listed)}")


def beside_rays(rows: list[Row], occlusion: str) -> list[tuple[Row, Row]]:
    """Rows by another visibility, each with the one by rays."""
    out = []
    for row in rows:
        if str(row["occlusion"]).startswith(occlusion):
            same = find(rows, size=row["size"], mode=row["mode"], window=row["window"], occlusion="rays")
            out += [(row, same[0])] if same else []
    return out


def voxels(rows: list[Row]) -> str | None:
    pairs = beside_rays(rows, "voxels")
    if not pairs:
        return None
    good = [r for r, rays in pairs if MUCH * r["bounce_s"] <= rays["bounce_s"] and r["rms"] <= ALIKE * rays["rms"]]
    listed = "; ".join(
        f"{r['size']}² {r['occlusion']}: {r['bounce_s'] / rays['bounce_s']:.2f} of the time of rays, "
        f"{r['rms'] / rays['rms']:.1f} times the RMS"
        for r, rays in pairs
    )
    return holds("Voxels are of limited use", not good, listed)


def kept(rows: list[Row]) -> str | None:
    pairs = beside_rays(rows, "rays, kept")
    if not pairs:
        return None
    gains = [BOUNCES * rays["bounce_s"] / (r["once_s"] + BOUNCES * r["bounce_s"]) for r, rays in pairs]
    listed = "; ".join(
        f"{r['size']}² / {r['window']}: {gain:.1f} times as fast over {BOUNCES} bounces, {r['kept']}"
        for (r, _), gain in zip(pairs, gains, strict=True)
    )
    return holds(
        "Kept pairs are of limited use",
        max(gains) < MUCH,
        f"{listed}; all pairs of 256² texels take 256 MiB, more are refused, and chance has no pairs to keep",
    )


def quadtree(rows: list[Row]) -> str | None:
    pairs = []
    for row in find(rows, senders="quadtree"):
        same = find(rows, size=row["size"], window=row["window"], senders="mipmapped", occlusion="rays")
        pairs += [(row, same[0])] if same else []
    if not pairs:
        return None
    listed = "; ".join(
        f"{r['size']}² / {r['window']}: {r['bounce_s'] / m['bounce_s']:.1f} times the time of mipmapped, "
        f"{r['rms'] / m['rms']:.2f} times its RMS"
        for r, m in pairs
    )
    slower = all(r["bounce_s"] > m["bounce_s"] for r, m in pairs)
    return holds("A quadtree in alpha is convenient, not fast", slower, listed)


def directional(rows: list[Row]) -> str | None:
    """At each size the fewest directions against the row of least error: faster, and worse?"""
    right, listed = True, []
    for size in dict.fromkeys(row["size"] for row in rows):
        mine = [row for row in find(rows, size=size) if row["senders"] == "directional"]
        others = [row for row in find(rows, size=size) if row["senders"] != "directional"]
        if not mine or not others:
            continue
        best = min(others, key=lambda row: float(row["rms"]))
        right = right and all(r["rms"] > best["rms"] for r in mine)
        right = right and min(r["bounce_s"] for r in mine) * MUCH <= best["bounce_s"]
        text = ", ".join(f"{r['mode'].split()[-1]} in {r['bounce_s']:.2f} s {r['rms']:.1%}" for r in mine)
        name = f"{best['mode']} {best['window']} by {best['occlusion']}"
        listed.append(f"{size}²: directions {text}; {name} in {best['bounce_s']:.2f} s {best['rms']:.1%}")
    if not listed:
        return None
    return holds("Directions are very fast, but of less quality", right, f"RMS is {'; '.join(listed)}")
