"""The published tables agree with themselves."""

import math

import pytest

from ikns.body.anthropometry import SEXES, TABLES, row, table

SAMPLED = ("biacromial_breadth", "acromion_radiale", "radiale_stylion", "hand_length")


@pytest.mark.parametrize("name", TABLES)
def test_every_row_names_its_landmarks_its_source_and_how_sure_we_are(name):
    for row_name in table(name)["row"]:
        for sex in SEXES:
            entry = row(name, row_name, sex=sex)
            assert all(entry[key] for key in ("proximal", "distal", "source"))
            assert entry["mark"] in {"V", "S", "R", "I"}
            assert any(isinstance(v, float | list) for v in entry.values())


def test_a_table_is_a_fresh_copy():
    table("de_leva")["row"]["upper_arm"]["male"]["gyration"][0] = 9.0
    row("de_leva", "upper_arm", sex="male")["gyration"][0] = 9.0
    assert row("de_leva", "upper_arm", sex="male")["gyration"][0] == 0.285


def test_landmarks_of_de_leva_are_in_its_glossary():
    whole = table("de_leva")
    used = {r[end] for r in whole["row"].values() for end in ("proximal", "distal")}
    assert used <= set(whole["landmark"])


@pytest.mark.parametrize("sex", SEXES)
@pytest.mark.parametrize(
    ("first", "second", "shared"),
    [
        ("head", "head_cervicale", "proximal"),
        ("trunk", "trunk_cervicale", "distal"),
        ("trunk", "trunk_shoulders", "distal"),
        ("upper_trunk", "upper_trunk_cervicale", "distal"),
        ("forearm", "forearm_stylion", "proximal"),
        ("hand", "hand_dactylion", "proximal"),
        ("hand_stylion_dactylion", "hand_stylion_metacarpale", "proximal"),
        ("hand_dactylion", "hand_stylion_dactylion", "distal"),
        ("shank", "shank_ankle", "proximal"),
        ("shank", "shank_sphyrion", "proximal"),
    ],
)
def test_a_segment_is_the_same_body_between_other_landmarks(sex, first, second, shared):
    a, b = (row("de_leva", name, sex=sex) for name in (first, second))
    assert a[shared] == b[shared]
    assert a["mass"] == b["mass"]
    # Rounding: lengths to 0.05 mm, centers to 0.00005 and radii to 0.0005 of a length;
    # the printed fractions come from unrounded lengths.
    lengths = a["length_mm"] + b["length_mm"]
    for ra, rb in zip(a["gyration"], b["gyration"], strict=True):
        tolerance = 0.0005 * lengths + 0.05 * (ra + rb)
        assert abs(ra * a["length_mm"] - rb * b["length_mm"]) <= tolerance
    at = [
        (r["com"] if shared == "proximal" else 1 - r["com"]) * r["length_mm"]
        for r in (a, b)
    ]
    assert abs(at[0] - at[1]) <= 0.00005 * lengths + 0.05 * 2


@pytest.mark.parametrize("sex", SEXES)
def test_trunk_is_the_sum_of_its_three_parts(sex):
    whole = row("de_leva", "trunk", sex=sex)
    parts = [
        row("de_leva", f"{part}_trunk", sex=sex)
        for part in ("upper", "middle", "lower")
    ]
    # Four numbers rounded to 0.05 mm; three masses and a sum to 0.00005.
    lengths = [p["length_mm"] for p in parts]
    assert sum(lengths) == pytest.approx(whole["length_mm"], abs=0.2)
    assert sum(p["mass"] for p in parts) == pytest.approx(whole["mass"], abs=0.0002)


@pytest.mark.parametrize("sex", SEXES)
def test_masses_of_a_whole_body_sum_to_one(sex):
    once, twice = ("head", "trunk"), "upper_arm forearm hand thigh shank foot".split()
    total = sum(row("de_leva", name, sex=sex)["mass"] for name in once)
    total += 2 * sum(row("de_leva", name, sex=sex)["mass"] for name in twice)
    # Two masses once and six twice, each rounded to 0.00005.
    assert total == pytest.approx(1.0, abs=14 * 0.00005)


@pytest.mark.parametrize("sex", SEXES)
def test_the_sagittal_radius_is_about_the_front_back_axis(sex):
    # A body wider than deep resists more about the front-back axis than about the
    # side-to-side axis: trunk, and hand with the palm forward. The head is deeper
    # than wide. A long body resists least about its long axis.
    for name, wide in (("trunk", True), ("hand", True), ("head", False)):
        sagittal, transverse, long = row("de_leva", name, sex=sex)["gyration"]
        assert (sagittal > transverse) is wide
        assert long < min(sagittal, transverse)


@pytest.mark.parametrize("sex", SEXES)
@pytest.mark.parametrize("name", SAMPLED)
def test_ansur_regressions_agree_with_their_own_deviations(sex, name):
    measure = row("ansur2", name, sex=sex)
    # SD known to 0.05 mm, r to 0.005: see = sd * sqrt(1 - r^2) to first order.
    left = math.sqrt(1 - measure["r"] ** 2)
    rounding = 0.05 * left + 0.005 * measure["sd_mm"] * measure["r"] / left + 0.05
    assert abs(measure["see_mm"] - measure["sd_mm"] * left) <= rounding
    # A mean of ratios and the ratio of means differ by less than the variance of
    # stature over its square, 0.15 %, plus rounding of the fraction, 0.00005.
    ratio = measure["mean_mm"] / row("ansur2", "stature", sex=sex)["mean_mm"]
    assert measure["fraction"] == pytest.approx(ratio, rel=0.0015, abs=0.00005)


@pytest.mark.parametrize("sex", SEXES)
def test_residuals_of_forearm_and_hand_spread_as_forearm_hand_length_does(sex):
    pair = [row("ansur2", n, sex=sex) for n in ("radiale_stylion", "hand_length")]
    rho = table("ansur2")["residual_correlation"]["radiale_stylion"]["hand_length"]
    explained = sum(m["r"] * m["sd_mm"] for m in pair) ** 2
    first, second = (m["see_mm"] for m in pair)
    spread = math.sqrt(explained + first**2 + second**2 + 2 * rho * first * second)
    # One value of rho for both sexes (.39 and .43 would be exact): 0.03 * 85 mm^2
    # over the spread of 23 mm, plus the rounding of r, 0.005 * 25 mm.
    published = row("ansur2", "forearm_hand", sex=sex)["sd_mm"]
    assert spread == pytest.approx(published, abs=0.25)
