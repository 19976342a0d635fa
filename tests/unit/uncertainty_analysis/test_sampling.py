"""Random variables, samples of machines and their tallies, against NumPy on the same numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from instruction_sets import SETS, computing_or_skipped
from machine_texts import PLANAR, edited, load_text
from made_source import MadeSource, random_deviation, with_sources
from truepose import _kernel
from truepose.machine import Machine
from truepose.probability.distributions import (
    ARCSINE,
    TRIANGULAR,
    TWO_POINT,
    UNIFORM,
    Distribution,
    discrete,
    empirical,
    normal,
    student_t,
)
from truepose.runs.first_order import ExactError
from truepose.runs.poses import PoseRun, required_sources
from truepose.runs.variables import Variables, variables_at
from truepose.sources import PoseBlock
from truepose.uncertainty_analysis.sampler import Random

Array = NDArray[np.float64]
DRAWN = 200_000
SEED = 17
AWKWARD = Path(__file__).parents[2] / "machines"
LISTED = discrete([0.0, 1.0, 5.0], [0.5, 0.3, 0.2]).distribution
MEASURED = empirical([0.1, -0.4, 0.2, 0.2, 0.9]).distribution

# Beyond it lies one of 100 000 samples of a normal figure of unit deviation: one of the seed's.
FAR = 4.4


@dataclass(frozen=True)
class Described:
    """Variables as `Random` asks for them."""

    distributions: tuple[Distribution, ...]
    correlation: Array | None = None
    stream: int = 3
    directions: tuple[NDArray[np.intp], ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"t{at}" for at in range(len(self.distributions)))

    @property
    def streams(self) -> NDArray[np.intp]:
        return np.full(len(self.distributions), self.stream, np.intp)

    @property
    def numbers(self) -> NDArray[np.intp]:
        return np.arange(len(self.distributions), dtype=np.intp)


def drawn(*distributions: Distribution, correlation: Array | None = None) -> Array:
    return Random(Described(distributions, correlation), SEED).rows(0, DRAWN)


CONTINUOUS = {
    UNIFORM: scipy.stats.uniform(-1.0, 2.0),
    TRIANGULAR: scipy.stats.triang(0.5, -1.0, 2.0),
    ARCSINE: scipy.stats.arcsine(-1.0, 2.0),
    normal(2.0): scipy.stats.norm(0.0, 0.5),
    student_t(5.0, 2.0): scipy.stats.t(5.0, 0.0, 0.5 / np.sqrt(5.0 / 3.0)),
}


@pytest.mark.parametrize("distribution", CONTINUOUS, ids=str)
def test_a_continuous_distribution_against_its_closed_form(distribution: Distribution) -> None:
    """Moments, and the empirical distribution function everywhere (Kolmogorov)."""
    found = drawn(*[distribution] * 9)
    assert np.abs(found.mean(axis=0)).max() < FAR / distribution.sigmas / np.sqrt(DRAWN)
    assert found.std(axis=0) == pytest.approx([1.0 / distribution.sigmas] * 9, rel=0.01)
    for t in found.T:
        test = scipy.stats.ks_1samp(t, CONTINUOUS[distribution].cdf)
        assert test.pvalue > 1e-4
        if distribution.bounded:
            assert np.abs(t).max() <= 1.0


@pytest.mark.parametrize("distribution", [TWO_POINT, LISTED, MEASURED], ids=str)
def test_a_stepped_distribution_takes_its_values_as_often(distribution: Distribution) -> None:
    values, up_to = distribution.steps
    found = drawn(*[distribution] * 5)
    for t in found.T:
        for value in np.unique(values):
            share = float(np.diff(up_to, prepend=0.0)[values == value].sum())
            slack = FAR * np.sqrt(share * (1.0 - share) / DRAWN)
            assert (t == value).mean() == pytest.approx(share, abs=slack)
    assert np.isin(found, values).all()


@pytest.mark.parametrize("distribution", [*CONTINUOUS, TWO_POINT, LISTED], ids=str)
def test_quantiles_of_a_distribution_are_those_of_its_samples(distribution: Distribution) -> None:
    (t,) = drawn(distribution).T
    for u in (0.001, 0.05, 0.3, 0.72, 0.99):
        expected = float(distribution.quantile(u))
        slack = FAR * np.sqrt(u * (1.0 - u) / DRAWN)
        assert (t < expected).mean() <= u + slack
        assert (t <= expected).mean() >= u - slack


def test_far_tails_of_a_normal_variable() -> None:
    t = Random(Described((normal(1.0),) * 4), SEED).rows(0, 2_000_000).ravel()
    for z in (4.0, 4.5, 5.0):
        expected = scipy.stats.norm.sf(z) * t.size
        for count in ((t > z).sum(), (t < -z).sum()):
            assert abs(count - expected) < FAR * np.sqrt(expected)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_a_direction_is_as_likely_anywhere(dimensions: int) -> None:
    # Numbers that begin in the middle of a counter's words, beside two that are by themselves.
    component = UNIFORM if dimensions == 3 else ARCSINE
    members = np.arange(2, 2 + dimensions)
    kinds = (UNIFORM, normal(3.0), *[component] * dimensions)
    rows = Random(Described(kinds, directions=(members,)), SEED).rows(0, DRAWN)
    direction = rows[:, members]
    assert np.allclose(np.linalg.norm(direction, axis=1), 1.0, rtol=1e-14)
    # Whatever the axis, a component has the distribution of its axis (Kolmogorov's statistic).
    random = np.random.default_rng(3)
    for _ in range(4):
        axis = random.standard_normal(dimensions)
        along = np.sort(direction @ axis / np.linalg.norm(axis))
        share = 0.5 * (1.0 + along) if dimensions == 3 else 1.0 - np.arccos(along) / np.pi
        assert np.abs(share - (np.arange(DRAWN) + 0.5) / DRAWN).max() < 2.0 / np.sqrt(DRAWN)
    # What stands beside it is drawn as it is without it.
    alone = Random(Described(kinds[:2]), SEED).rows(0, DRAWN)
    assert np.array_equal(rows[:, :2], alone)
    assert abs(np.corrcoef(rows[:, 1], direction[:, 0])[0, 1]) < 5.0 / np.sqrt(DRAWN)


def test_variables_are_independent() -> None:
    kinds = [*CONTINUOUS, TWO_POINT, LISTED]
    found = drawn(*kinds, *kinds, *[normal(3.0)] * 7, *[UNIFORM] * 3)
    off = np.corrcoef(found.T) - np.eye(found.shape[1])
    assert np.abs(off).max() < 5.0 / np.sqrt(DRAWN)
    squares = np.corrcoef(np.square(found[:, [0, 1, 2, 3, 15, 16, 17]]).T)
    assert np.abs(squares - np.eye(7)).max() < 5.0 / np.sqrt(DRAWN)
    # Nor does a sample tell of the next one.
    for t in found.T:
        assert abs(np.corrcoef(t[1:], t[:-1])[0, 1]) < 5.0 / np.sqrt(DRAWN)


def matrix(*pairs: tuple[int, int, float], count: int) -> Array:
    found = np.eye(count)
    for one, other, coefficient in pairs:
        found[one, other] = found[other, one] = coefficient
    return found


@pytest.mark.parametrize(
    "kinds",
    [
        (normal(3.0), normal(2.0), normal(1.0)),
        (UNIFORM, UNIFORM, UNIFORM),
        (normal(3.0), UNIFORM, TRIANGULAR),
        (ARCSINE, TWO_POINT, LISTED),
        (student_t(6.0), student_t(6.0), normal(2.0)),
    ],
    ids=lambda kinds: "-".join(kind.name for kind in kinds),
)
def test_correlated_variables(kinds: tuple[Distribution, ...]) -> None:
    """They have the correlation stated, each its own distribution, and their neighbours theirs."""
    others = (normal(2.0), UNIFORM, normal(1.5), student_t(8.0))
    every = (others[0], *kinds[:2], *others[1:3], kinds[2], others[3])
    linked = [1, 2, 5]
    stated = matrix((1, 2, 0.5), (1, 5, -0.3), (2, 5, 0.2), count=7)
    found = drawn(*every, correlation=stated)
    # A heavy tail makes a correlation as sampled scatter more.
    slack = 0.02 if kinds[0].name == "student-t" else 6.0 / np.sqrt(DRAWN)
    assert np.abs(np.corrcoef(found.T) - stated).max() < slack
    deviations = [1.0 / each.sigmas for each in every]
    assert found.std(axis=0) == pytest.approx(deviations, rel=0.02)
    for column in linked:
        quantiles = every[column].quantile([0.1, 0.5, 0.8])
        for u, quantile in zip((0.1, 0.5, 0.8), quantiles, strict=True):
            near = FAR * np.sqrt(u * (1.0 - u) / DRAWN)
            assert (found[:, column] < quantile).mean() <= u + near
            assert (found[:, column] <= quantile).mean() >= u - near


def test_a_correlation_of_others_leaves_a_variable_as_it_is() -> None:
    kinds = (normal(2.0), normal(3.0), normal(1.5), normal(1.0), UNIFORM, UNIFORM)
    plain = drawn(*kinds)
    linked = drawn(*kinds, correlation=matrix((1, 2, 0.5), (4, 5, -0.3), count=6))
    assert np.array_equal(plain[:, [0, 3]], linked[:, [0, 3]])


@pytest.mark.parametrize("kinds", [(normal(2.0), UNIFORM, ARCSINE, LISTED, student_t(5.0))])
def test_a_sample_depends_on_its_number_alone(kinds: tuple[Distribution, ...]) -> None:
    random = Random(Described(kinds), SEED)
    whole = random.rows(0, 1000)
    assert np.array_equal(random.rows(137, 400), whole[137:537])
    assert np.array_equal(random.rows(999, 1), whole[999:])
    assert not np.isin(Random(Described(kinds), SEED + 1).rows(0, 1000)[:, 0], whole[:, 0]).any()
    far = random.rows(2**40, 10)
    assert np.isfinite(far).all()
    assert np.array_equal(random.rows(2**40 + 3, 2), far[3:5])


def test_samples_of_another_source_are_others() -> None:
    one, other = (Random(Described((UNIFORM,) * 2, stream=at), SEED).rows(0, 50) for at in (3, 4))
    assert not np.isin(one, other).any()


@pytest.fixture
def restored() -> Iterator[None]:
    threads = _kernel.threads()
    yield
    _kernel.threads(threads)


@pytest.mark.parametrize("name", SETS)
def test_every_instruction_set_draws_the_same(name: str) -> None:
    kinds = [*CONTINUOUS, TWO_POINT, LISTED, MEASURED, *[normal(2.5)] * 4]
    random = Random(Described((*kinds, UNIFORM, TRIANGULAR), None), SEED)
    linked = Random(Described((UNIFORM, normal(2.0)), matrix((0, 1, 0.5), count=2)), SEED)
    best = random.rows(0, 5000), linked.rows(0, 5000)
    with computing_or_skipped(name):
        found = random.rows(0, 5000)
        again = linked.rows(0, 5000)
    # A cosine is in these; a fused product and sum rounds once, two operations twice.
    rounded = [each.name in ("arcsine", "student-t") for each in random.distributions]
    assert np.array_equal(found[:, ~np.array(rounded)], best[0][:, ~np.array(rounded)])
    assert np.abs(found - best[0]).max() < 1e-15
    assert np.array_equal(again, best[1])


def of_file(name: str) -> Path:
    shipped = MACHINES / f"{name}.toml"
    return shipped if shipped.exists() else AWKWARD / f"{name}.toml"


KINDS = [
    "planar_two_slider",
    "hexapod",
    "linear_delta",
    "rotary_delta",
    "hexaglide",
    "3prs",
    "tricept",
    "guided_body",
    "mixed_spatial",
    "overconstrained",
    "overconstrained_body",
]


@dataclass(frozen=True)
class Studied:
    """A machine at some poses, with sources that move most of its parameters, some in groups."""

    machine: Machine
    block: PoseBlock
    moves: Variables
    random: Random

    @classmethod
    def of(cls, machine: Machine, poses: Array | None = None) -> Studied:
        given = machine.poses()[:4] if poses is None else poses
        (block,) = PoseRun(machine, given, machine.condition)
        moves = variables_at(machine, block, required_sources(machine, machine.condition))
        return cls(machine, block, moves, Random(moves, SEED))

    @property
    def study(self) -> _kernel.Study:
        return self.whitened(None)

    def whitened(self, whitening: Array | None) -> _kernel.Study:
        shifted, shift = self.moves.shift
        return _kernel.Study(
            self.machine.kernel,
            self.block.joints,
            self.block.placements,
            shifted,
            shift,
            self.moves.columns,
            self.moves.variable_of.tolist(),
            self.moves.half_width,
            whitening,
        )

    def tallies(self, more: int = 0) -> _kernel.Tallies:
        m = len(self.machine.components)
        kinds = len({name in ("x", "y", "z") for name in self.machine.components})
        table = np.zeros((self.block.indices.size, m + kinds + more))
        return _kernel.Tallies(table, table + 1e-7, table.shape[1], m)

    def sampled(self, first: int, count: int) -> _kernel.Tallies:
        tallies = self.tallies()
        self.study.sample(self.random.variables, SEED, first, count, tallies)
        return tallies

    def errors(self, first: int, count: int) -> tuple[Array, NDArray[np.bool_]]:
        """(pose, sample, component), and whether there is one."""
        t = self.random.rows(first, count)
        poses = self.block.indices.size
        move = ExactError(self.machine, self.block, self.moves)
        found = [move(np.full(count, pose), t) for pose in range(poses)]
        return np.stack([each for each, _ in found]), np.stack([s == 0 for _, s in found])

    def sizes(self, errors: Array) -> Array:
        """(..., n_quantity)."""
        places = np.array([name in ("x", "y", "z") for name in self.machine.components])
        parts = [errors[..., places], errors[..., ~places]]
        return np.stack([np.linalg.norm(p, axis=-1) for p in parts if p.shape[-1]], axis=-1)


@cache
def studied(name: str) -> Studied:
    machine = tp.load(of_file(name))
    seed = sum(map(ord, name))
    made = [MadeSource(f"made {at}", random_deviation(machine, seed + at)) for at in range(2)]
    return Studied.of(with_sources(machine, *made))


@pytest.mark.parametrize("name", KINDS)
def test_a_sample_is_the_exact_displacement(name: str) -> None:
    """One by one: the mean of one sample is the sample."""
    of = studied(name)
    errors, fine = of.errors(40, 12)
    assert fine.all()
    expected = np.concatenate([errors, of.sizes(errors)], axis=-1)
    for number in range(12):
        one = of.sampled(40 + number, 1)
        assert np.abs(one.mean - expected[:, number]).max() < 1e-13
        assert np.abs(one.extremes - expected[:, number, :, None]).max() < 1e-13
    assert np.abs(errors).max() > 1e-5


@pytest.mark.parametrize("name", KINDS)
def test_moments_and_extremes_of_many_samples(name: str) -> None:
    of = studied(name)
    errors, _ = of.errors(0, 700)
    found = of.sampled(0, 700)
    every = np.concatenate([errors, of.sizes(errors)], axis=-1)
    assert found.count.tolist() == [700] * len(errors)
    assert found.failed.tolist() == [0] * len(errors)
    assert np.abs(found.mean - every.mean(axis=1)).max() < 1e-13
    assert np.abs(found.extremes[..., 0] - every.min(axis=1)).max() < 1e-13
    assert np.abs(found.extremes[..., 1] - every.max(axis=1)).max() < 1e-13
    for pose, values in enumerate(errors):
        expected = np.cov(values.T)
        scale = np.sqrt(np.diag(expected))
        assert np.abs((found.covariance[pose] - expected) / np.outer(scale, scale)).max() < 1e-9


def test_given_variables_are_taken_as_they_are() -> None:
    of = studied("hexapod")
    tallies = of.tallies()
    of.study.sample_given(of.random.variables, of.random.rows(100, 300), tallies)
    assert np.allclose(tallies.mean, of.sampled(100, 300).mean, rtol=0, atol=1e-15)


def test_the_machine_at_its_shifts() -> None:
    of = studied("hexapod")
    expected, _ = of.machine.kernel.displacement(
        of.block.joints, of.block.placements, *of.moves.shift
    )
    assert (of.study.status == 0).all()
    assert np.abs(of.study.shift_error - expected).max() < 1e-14


@pytest.mark.parametrize("name", ["planar_two_slider", "hexapod", "overconstrained"])
def test_samples_in_parts_are_the_same(name: str) -> None:
    of = studied(name)
    whole, parts = of.sampled(5, 1000), of.tallies()
    for first, count in ((5, 137), (142, 1), (143, 862)):
        of.study.sample(of.random.variables, SEED, first, count, parts)
    apart = of.sampled(5, 600)
    apart.merge(of.sampled(605, 400))
    for found in (parts, apart):
        assert_same(of, found, whole)


def assert_same(of: Studied, found: _kernel.Tallies, expected: _kernel.Tallies) -> None:
    """Of the same samples, but for the last digits of a pose (of the size of the machine)."""
    size = of.machine.characteristic_length
    assert np.array_equal(found.count, expected.count)
    assert np.array_equal(found.failed, expected.failed)
    assert np.abs(found.mean - expected.mean).max() < 1e-12 * size
    assert np.abs(found.extremes - expected.extremes).max() < 1e-12 * size
    deviation = np.sqrt(np.einsum("ncc->nc", expected.covariance))
    scale = deviation[:, :, None] * deviation[:, None]
    assert (np.abs(found.covariance - expected.covariance) < 1e-9 * scale).all()
    for share in (0.02, 0.5, 0.97):
        values = found.quantiles([share]), expected.quantiles([share])
        # A value at the edge of a bin may fall on its other side.
        assert np.abs(values[0] - values[1]).max() < 1e-3 * deviation.max()


@pytest.mark.usefixtures("restored")
@pytest.mark.parametrize("name", ["planar_two_slider", "hexapod", "guided_body", "overconstrained"])
def test_threads_give_the_same(name: str) -> None:
    of = studied(name)
    found = []
    for threads in (1, 2):
        tp.threads(threads)
        found.append(of.sampled(0, 3000))
    assert np.array_equal(found[0].mean, found[1].mean)
    assert np.array_equal(found[0].covariance, found[1].covariance)
    assert np.array_equal(found[0].extremes, found[1].extremes)
    shares = [0.0, 0.025, 0.5, 0.975, 1.0]
    assert np.array_equal(found[0].quantiles(shares), found[1].quantiles(shares))


@pytest.mark.parametrize("instructions", SETS)
@pytest.mark.parametrize("name", ["planar_two_slider", "hexapod", "guided_body", "overconstrained"])
def test_instruction_sets_give_the_same(name: str, instructions: str) -> None:
    of = studied(name)
    best = of.sampled(0, 3000)
    with computing_or_skipped(instructions):
        found = of.sampled(0, 3000)
    assert_same(of, found, best)


def by_identity(of: Studied) -> dict[tuple[str, int], Array]:
    """Samples of each variable, by its source and its number there."""
    identities = zip(of.moves.sources, of.moves.numbers.tolist(), strict=True)
    return dict(zip(identities, of.random.rows(0, 200).T, strict=True))


def test_a_source_left_out_leaves_the_draws_of_the_others() -> None:
    machine = tp.load(MACHINES / "hexapod_all_sources.toml")
    whole = Studied.of(machine)
    every = by_identity(whole)
    sources = required_sources(machine, machine.condition)
    banded = set(whole.moves.sources)
    assert len(banded) > 3
    for removed in sources:
        if removed.name not in banded:
            continue
        kept = [source for source in sources if source is not removed]
        part = Studied.of(with_sources(machine, *kept))
        assert set(part.moves.sources) == banded - {removed.name}
        for identity, t in by_identity(part).items():
            assert np.array_equal(every[identity], t)


# Struts of 500 -+ 160 mm between carriages 600 mm apart do not always meet.
LOOSE = edited(
    PLANAR,
    ("length = 500\nsection", "length = 500\nlength_tolerance = 160\nsection"),
    ("[-0.3, 0.3]", "[-160, 160]"),
    ("temperature = 35\nforce", "force"),
    ("x = 1200, y = -1500", "x = 0"),
)


def test_samples_without_a_result_are_counted_and_not_averaged(tmp_path: Path) -> None:
    of = Studied.of(load_text(tmp_path, LOOSE), np.array([[0.3, 0.2], [0.4, 0.2], [0.12, 0.2]]))
    errors, fine = of.errors(0, 20_000)
    found = of.sampled(0, 20_000)
    assert (found.failed > 0).any()
    assert np.array_equal(found.count, fine.sum(axis=1))
    assert np.array_equal(found.failed, (~fine).sum(axis=1))
    for pose, (values, sound) in enumerate(zip(errors, fine, strict=True)):
        assert np.abs(found.mean[pose, :2] - values[sound].mean(axis=0)).max() < 1e-12
        assert np.abs(found.covariance[pose] - np.cov(values[sound].T)).max() < 1e-12
        assert np.abs(found.extremes[pose, :2, 1] - values[sound].max(axis=0)).max() < 1e-12


def tallied(values: Array, width: float, origin: float = 0.0) -> _kernel.Tallies:
    columns = values.shape[1]
    table = np.full((1, columns), origin)
    tallies = _kernel.Tallies(table, np.full((1, columns), width), columns, columns)
    tallies.add(values)
    return tallies


def test_tallies_against_numpy() -> None:
    random = np.random.default_rng(4)
    base = random.normal(size=(50_000, 3))
    values = np.stack([base[:, 0], base[:, 1] ** 2 + base[:, 0], 7.0 + 1e-3 * base[:, 2]], axis=1)
    found = tallied(values, 1e-5)
    assert found.mean[0] == pytest.approx(values.mean(axis=0), rel=1e-10, abs=1e-12)
    assert found.covariance[0] == pytest.approx(np.cov(values.T), rel=1e-8, abs=1e-9)
    assert np.array_equal(found.extremes[0].T, [values.min(axis=0), values.max(axis=0)])
    shares = np.linspace(0.0, 1.0, 41)
    expected = np.quantile(values, shares, axis=0).T
    # 2048 bins, of which a quarter may be empty because their width goes by factors of two.
    bin_width = 4.0 * np.abs(values).max(axis=0) / 1024
    assert (np.abs(found.quantiles(shares.tolist())[0] - expected) < bin_width[:, None]).all()
    assert np.array_equal(found.quantiles([0.0, 1.0])[0], found.extremes[0])


def test_the_shortest_interval_against_sorted_samples() -> None:
    values = np.random.default_rng(5).exponential(size=(200_000, 1))
    found = tallied(values, 1e-2)
    for share in (0.5, 0.9, 0.99):
        ordered = np.sort(values[:, 0])
        held = round(share * len(ordered))
        widths = ordered[held - 1 :] - ordered[: len(ordered) - held + 1]
        lower, upper = found.shortest(share)[0, 0]
        assert upper - lower == pytest.approx(widths.min(), abs=0.02)
        inside = ((values >= lower) & (values <= upper)).mean()
        assert inside == pytest.approx(share, abs=2e-3)
        # Where the density falls all the way it begins at the very start.
        assert lower < 0.02


def test_tallies_widen_to_whatever_comes() -> None:
    values = np.concatenate([np.linspace(-1e-9, 1e-9, 101), [-3e5, 2e5]])[:, np.newaxis]
    found = tallied(values, 1e-12)
    assert found.extremes[0, 0].tolist() == [-3e5, 2e5]
    assert found.count.tolist() == [103]
    assert found.quantiles([0.5])[0, 0, 0] == pytest.approx(0.0, abs=1e3)
    assert found.blank().count.tolist() == [0]
    assert np.isnan(found.blank().quantiles([0.5])).all()


def test_tallies_of_other_columns_do_not_merge() -> None:
    one, other = tallied(np.zeros((3, 1)), 1.0), tallied(np.zeros((3, 2)), 1.0)
    with pytest.raises(ValueError, match="other columns"):
        one.merge(other)


def test_the_length_in_the_ellipsoid_is_a_column() -> None:
    of = studied("hexapod")
    errors, _ = of.errors(0, 400)
    poses = len(errors)
    random = np.random.default_rng(2)
    centre, matrices = 1e-4 * random.normal(size=(poses, 3)), random.normal(size=(poses, 3, 3))
    tallies = of.tallies(1)
    whitening = np.concatenate([centre, matrices.reshape(poses, 9)], axis=1)
    of.whitened(whitening).sample(of.random.variables, SEED, 0, 400, tallies)
    away = errors[..., :3] - centre[:, np.newaxis]
    expected = np.linalg.norm(np.einsum("nij,nsj->nsi", matrices, away), axis=-1)
    assert np.allclose(tallies.mean[:, -1], expected.mean(axis=1), rtol=1e-10)
    assert np.allclose(tallies.extremes[:, -1, 1], expected.max(axis=1), rtol=1e-10)
