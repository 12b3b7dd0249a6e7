#!/usr/bin/env python3
"""Writes the figures of docs/study/*/study.json into docs/studies.md, between its two marks. Sentences that no figure bears stand here."""

import json
import pathlib
import textwrap

SCENES = [
    ("veach-mis", "Veach's scene", "error against time on Veach's scene",
     "Small lights are found by sampling lights, reflections in polished plates by sampling the BRDF, and `mis` does both."),
    ("knot", "Two knots, a mesh with smooth normals", "error against time for two knots",
     "Most surfaces are dull and the lights not large, so samples of the BRDF seldom hit one."),
    ("many-spheres", "140 spheres under twelve small lights", "error against time under twelve small lights",
     "Directions that are sampled without regard to the lights hardly ever hit one."),
]
BEGIN, END = "<!-- studies: made by docs/study/make.sh -->", "<!-- end of studies -->"
HIGH = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def two_digits(value):
    """`0.017`, `3.2 × 10⁻⁴`."""
    if 1e-3 <= value < 1e4:
        return f"{float(f'{value:.2g}'):g}"
    digits, power = f"{value:.1e}".split("e")
    return f"{digits} × 10{str(int(power)).translate(HIGH)}"


def time(seconds):
    """`12 ms`, `1.3 s`."""
    if seconds < 0.995:
        return f"{two_digits(1000 * seconds)} ms"
    return f"{two_digits(seconds)} s"


def last(price):
    """`0.017 in 129 ms`."""
    point = price["points"][-1]
    return f"{two_digits(point['relative_mse']['value'])} in {time(point['seconds']['value'])}"


def slope(price):
    """`−1.21 ± 0.04`."""
    low, high = (price["slope"][end] for end in ("low", "high"))
    reach = "∞" if low is None or high is None else f"{(high - low) / 2:.2f}"
    return f"{price['slope']['value']:.2f} ± {reach}".replace("-", "−")


def caption(folder, name, alt, sentence):
    """One study: its chart and what it shows."""
    study = json.loads((pathlib.Path("docs/study") / folder / "study.json").read_text())
    prices = {price["label"]: price for price in study["prices"]}
    default = study["circumstances"]["estimator"]
    spp = study["prices"][0]["points"][-1]["spp"]
    others = [price for price in study["prices"] if price["knob"] in ("estimator", "adaptive")]
    figures = ", ".join([f"{default} {last(study['prices'][0])}", *(f"{p['label']} {last(p)}" for p in others)])
    slopes = f"{study['circumstances']['sampler']} {slope(study['prices'][0])}"
    if "independent" in prices:
        slopes += f", independent {slope(prices['independent'])}"
    text = f"*{name}*: {sentence} Relative MSE after {spp} samples a pixel: {figures}. Slopes: {slopes}."
    return f"![{alt}](study/{folder}/error-over-time.svg)\n\n{textwrap.fill(text, 130)}\n"


def circumstances():
    """What the figures hold for."""
    studies = [json.loads((pathlib.Path("docs/study") / scene[0] / "study.json").read_text()) for scene in SCENES]
    c = studies[0]["circumstances"]
    each = lambda of: ", ".join(str(of(study)) for study in studies)
    loads = sorted(study["circumstances"]["load"] or 0 for study in studies)
    return textwrap.fill(
        f"The figures stand in `docs/study`: {each(lambda s: round(s['seconds']))} s, "
        f"{each(lambda s: ' x '.join(map(str, s['film'])))} pixels, {each(lambda s: s['seeds'])} seeds, commit {c['commit']}, "
        f"{c['cpu']}, {c['threads']} threads, {c['lanes']} lanes, load before {loads[0]:.1f} to {loads[-1]:.1f}. "
        "Bands and ± are 95 %; where few samples find a light they are wide, and slopes as uncertain.", 130) + "\n"


def main():
    page = pathlib.Path("docs/studies.md")
    text = page.read_text()
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    parts = [caption(*scene) for scene in SCENES] + [circumstances()]
    page.write_text(before + BEGIN + "\n" + "\n".join(parts) + END + after)


main()
