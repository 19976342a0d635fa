//! Intervals against exact arithmetic: on operands of every exponent and on nasty ones, a result holds
//! the exact value of every point and is not much wider than it must be.

use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::{Add, Mul, Neg, Sub};
use std::sync::LazyLock;
use truepose_kernel::scalar::{Interval, Scalar};

/// How many times a test repeats itself: `count`, or less where the arithmetic is not optimised.
fn times(count: usize) -> std::ops::Range<usize> {
    0..if cfg!(debug_assertions) { count / 50 } else { count }
}

// ---- exact arithmetic ----

/// `digits * 2^exponent`, as large or small as may be.
#[derive(Clone, Debug)]
struct Exact {
    digits: BigInt,
    exponent: i64,
}

impl Exact {
    fn new(digits: BigInt, exponent: i64) -> Self {
        Exact { digits, exponent }
    }
    /// A finite double.
    fn of(value: f64) -> Self {
        assert!(value.is_finite());
        let bits = value.to_bits();
        let (fraction, exponent) = (bits & ((1 << 52) - 1), (bits >> 52 & 0x7ff) as i64);
        let digits = fraction as i64 | if exponent > 0 { 1 << 52 } else { 0 };
        let signed = if value < 0.0 { -digits } else { digits };
        Exact::new(BigInt::from(signed), exponent.max(1) - 1075)
    }
    fn sign(&self) -> i32 {
        match self.digits.sign() {
            Sign::Minus => -1,
            Sign::NoSign => 0,
            Sign::Plus => 1,
        }
    }
    fn abs(self) -> Self {
        if self.sign() < 0 { -&self } else { self }
    }
    fn min(self, other: Self) -> Self {
        if self <= other { self } else { other }
    }
    fn max(self, other: Self) -> Self {
        if self <= other { other } else { self }
    }
    fn combined(&self, other: &Self, of: impl Fn(&BigInt, &BigInt) -> BigInt) -> Self {
        let (more, less) = (self.exponent.max(other.exponent), self.exponent.min(other.exponent));
        let digits = match self.exponent.cmp(&other.exponent) {
            Ordering::Equal => of(&self.digits, &other.digits),
            Ordering::Greater => of(&(&self.digits << (more - less) as usize), &other.digits),
            Ordering::Less => of(&self.digits, &(&other.digits << (more - less) as usize)),
        };
        Exact::new(digits, less)
    }
    /// The exponent of the leading digit plus one.
    fn size(&self) -> i64 {
        self.digits.bits() as i64 + self.exponent
    }
}

impl Add for &Exact {
    type Output = Exact;
    fn add(self, other: &Exact) -> Exact {
        self.combined(other, |a, b| a + b)
    }
}
impl Sub for &Exact {
    type Output = Exact;
    fn sub(self, other: &Exact) -> Exact {
        self.combined(other, |a, b| a - b)
    }
}
impl Mul for &Exact {
    type Output = Exact;
    fn mul(self, other: &Exact) -> Exact {
        Exact::new(&self.digits * &other.digits, self.exponent + other.exponent)
    }
}
impl Neg for &Exact {
    type Output = Exact;
    fn neg(self) -> Exact {
        Exact::new(-&self.digits, self.exponent)
    }
}
impl PartialEq for Exact {
    fn eq(&self, other: &Exact) -> bool {
        self.partial_cmp(other) == Some(Ordering::Equal)
    }
}
impl PartialOrd for Exact {
    fn partial_cmp(&self, other: &Exact) -> Option<Ordering> {
        let (sign, others) = (self.sign(), other.sign());
        let order = if sign != others || sign == 0 {
            sign.cmp(&others)
        } else if self.size() != other.size() {
            if sign > 0 { self.size().cmp(&other.size()) } else { other.size().cmp(&self.size()) }
        } else {
            (self - other).sign().cmp(&0)
        };
        Some(order)
    }
}

/// `bound <= value`, exactly; an infinite bound is beyond every value.
fn not_above(bound: f64, value: &Exact) -> bool {
    if bound.is_finite() { Exact::of(bound) <= *value } else { bound == f64::NEG_INFINITY }
}

/// `bound >= value`, exactly.
fn not_below(bound: f64, value: &Exact) -> bool {
    not_above(-bound, &-value)
}

fn holds(result: Interval, value: &Exact) -> bool {
    not_above(result.lower, value) && not_below(result.upper, value)
}

/// The interval with both bounds moved `steps` inward. They may pass each other.
fn inward(result: Interval, steps: usize) -> (f64, f64) {
    (0..steps).fold((result.lower, result.upper), |(l, u), _| (l.next_up(), u.next_down()))
}

/// Whether both bounds are within four steps of those of the exact result.
fn is_tight(result: Interval, lower: &Exact, upper: &Exact) -> bool {
    let (l, u) = inward(result, 4);
    not_below(l, lower) && not_above(u, upper)
}

fn is_sane(result: Interval) -> bool {
    // Not for a NaN either.
    result.lower <= result.upper && result.lower < f64::INFINITY && result.upper > f64::NEG_INFINITY
}

// ---- operands ----

/// A small generator, so that the samples are the same everywhere.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }
    /// In [0, 1).
    fn share(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
    fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }
    fn one_of(&mut self, values: &[f64]) -> f64 {
        values[self.below(values.len())]
    }
    fn sign(&mut self) -> f64 {
        self.one_of(&[-1.0, 1.0])
    }
    /// Any finite double, every exponent as often as any other.
    fn any(&mut self) -> f64 {
        loop {
            let value = f64::from_bits(self.bits());
            if value.is_finite() {
                return value;
            }
        }
    }
    /// With an exponent of two from these.
    fn near(&mut self, exponents: std::ops::Range<i32>) -> f64 {
        let exponent = exponents.start + self.below(exponents.len()) as i32;
        // In two factors: 2^-1074 is no double's power for `powi` of 1/2 alone.
        let half = exponent / 2;
        (1.0 + self.share()) * 2f64.powi(half) * 2f64.powi(exponent - half) * self.sign()
    }
    fn nasty(&mut self) -> f64 {
        let value = self.one_of(&NASTY);
        let steps = if self.below(2) == 0 { 0 } else { self.below(4) };
        let up = self.below(2) == 0;
        let moved = (0..steps).fold(value, |x, _| if up { x.next_up() } else { x.next_down() });
        if moved.is_finite() { moved * self.sign() } else { value }
    }
    fn number(&mut self) -> f64 {
        match self.below(8) {
            0..=2 => self.any(),
            3 | 4 => 20.0 * self.share() - 10.0,
            5 | 6 => self.nasty(),
            _ => match self.below(3) {
                0 => self.near(-545..-530), // squares at the smallest normal number
                1 => self.near(-1074..-1010),
                _ => self.near(500..520), // squares at the largest
            },
        }
    }
    /// A second operand that makes a result near a limit with the first, or cancels most of it.
    fn partner(&mut self, value: f64) -> f64 {
        let limit = self.one_of(&[f64::MIN_POSITIVE, f64::from_bits(1), f64::MAX, 1e-280, 1.0]);
        let scale = (1.0 + self.share()) * self.one_of(&[0.25, 0.5, 1.0]);
        let partner = match self.below(4) {
            0 => limit / value * scale,
            1 => value / limit * scale,
            2 => -value * (1.0 + f64::EPSILON * self.below(8) as f64),
            _ => self.number(),
        };
        if partner.is_finite() { partner } else { self.number() }
    }
    /// An interval with `value` as one of its bounds.
    fn around(&mut self, value: f64) -> Interval {
        let other = match self.below(10) {
            0 | 1 => value,
            2 => value.next_up(),
            3 => (0..self.below(6)).fold(value, |x, _| x.next_down()),
            4 => value * (1.0 + 0.01 * self.share()),
            5 => -value,
            6 => self.one_of(&[0.0, -0.0]),
            7 | 8 => self.number(),
            _ => self.one_of(&[f64::INFINITY, f64::NEG_INFINITY]),
        };
        if value <= other { Interval::new(value, other) } else { Interval::new(other, value) }
    }
    fn interval(&mut self) -> Interval {
        if self.below(500) == 0 {
            return Interval::ENTIRE;
        }
        let value = self.number();
        self.around(value)
    }
    fn pair(&mut self) -> (Interval, Interval) {
        let (a, x) = (self.number(), self.interval());
        if self.below(2) == 0 {
            return (x, self.interval());
        }
        let b = self.partner(a);
        (self.around(a), self.around(b))
    }
    /// A finite number of the interval.
    fn inside(&mut self, x: Interval) -> f64 {
        let (lower, upper) = (x.lower.max(f64::MIN), x.upper.min(f64::MAX));
        match self.below(3) {
            // Evenly among the doubles.
            0 => from_place(
                place(lower) + (self.share() * (place(upper) - place(lower)) as f64) as i128,
            )
            .clamp(lower, upper),
            1 => (lower + self.share() * (upper - lower)).clamp(lower, upper),
            _ => self.any().clamp(lower, upper),
        }
    }
    /// Both ends (what is farthest towards an infinite one) and one inside.
    fn points(&mut self, x: Interval) -> [f64; 3] {
        [x.lower.max(f64::MIN), x.upper.min(f64::MAX), self.inside(x)]
    }
    /// Pairs of points: the corners and one inside.
    fn point_pairs(&mut self, x: Interval, y: Interval) -> [(f64, f64); 5] {
        let ([a, b, c], [d, e, f]) = (self.points(x), self.points(y));
        [(a, d), (a, e), (b, d), (b, e), (c, f)]
    }
}

/// Where a double stands among all.
fn place(value: f64) -> i128 {
    let magnitude = value.abs().to_bits() as i128;
    if value < 0.0 { -magnitude } else { magnitude }
}

fn from_place(place: i128) -> f64 {
    let magnitude = f64::from_bits(place.unsigned_abs() as u64);
    if place < 0 { -magnitude } else { magnitude }
}

const NASTY: [f64; 24] = [
    0.0,
    -0.0,
    5e-324,
    1e-310,
    2.225073858507201e-308, // the largest number that is not normal
    f64::MIN_POSITIVE,
    2.0 * f64::MIN_POSITIVE,
    1e-280,
    1.4916681462400413e-154, // squares to the smallest normal number
    1.5717277847026288e-162, // squares to half of the smallest number
    1e-140,                  // squares to what the fused operations split at
    f64::EPSILON,
    0.5 * f64::EPSILON,
    0.5,
    1.0,
    2.0,
    3.0,
    FRAC_PI_2,
    PI,
    9007199254740992.0,
    1.3407807929942596e154, // squares to the largest number
    0.5 * f64::MAX,
    f64::MAX,
    1e300,
];

// ---- arithmetic ----

#[test]
fn sums_and_differences() {
    let mut random = Random(1);
    for _ in times(700_000) {
        let (x, y) = random.pair();
        let (sum, difference) = (x + y, x - y);
        assert!(is_sane(sum) && is_sane(difference), "{x:?} {y:?}");
        for (a, b) in random.point_pairs(x, y) {
            let (a, b) = (Exact::of(a), Exact::of(b));
            assert!(holds(sum, &(&a + &b)), "{x:?} + {y:?} = {sum:?}");
            assert!(holds(difference, &(&a - &b)), "{x:?} - {y:?} = {difference:?}");
        }
        if x.is_finite() && y.is_finite() {
            let [a, b, c, d] = [x.lower, x.upper, y.lower, y.upper].map(Exact::of);
            assert!(is_tight(sum, &(&a + &c), &(&b + &d)), "{x:?} + {y:?} = {sum:?}");
            assert!(is_tight(difference, &(&a - &d), &(&b - &c)), "{x:?} - {y:?} = {difference:?}");
        }
        assert_eq!(x + Interval::point(0.0) == x, x + -Interval::point(0.0) == x);
    }
}

/// The least and the greatest product of two finite intervals.
fn exact_products(x: Interval, y: Interval) -> (Exact, Exact) {
    let [a, b, c, d] = [x.lower, x.upper, y.lower, y.upper].map(Exact::of);
    let corners = || [&a * &c, &a * &d, &b * &c, &b * &d].into_iter();
    (corners().reduce(Exact::min).unwrap(), corners().reduce(Exact::max).unwrap())
}

#[test]
fn products() {
    let mut random = Random(2);
    for _ in times(700_000) {
        let (x, y) = random.pair();
        let product = x * y;
        assert!(is_sane(product), "{x:?} {y:?}");
        for (a, b) in random.point_pairs(x, y) {
            assert!(
                holds(product, &(&Exact::of(a) * &Exact::of(b))),
                "{x:?} * {y:?} = {product:?}"
            );
        }
        if x.is_finite() && y.is_finite() {
            let (lower, upper) = exact_products(x, y);
            assert!(is_tight(product, &lower, &upper), "{x:?} * {y:?} = {product:?}");
            // An exact zero stays, whichever bound it is.
            assert!(lower.sign() != 0 || product.lower == 0.0, "{x:?} * {y:?} = {product:?}");
            assert!(upper.sign() != 0 || product.upper == 0.0, "{x:?} * {y:?} = {product:?}");
        }
    }
}

#[test]
fn products_with_one_number_are_those_with_its_interval() {
    let mut random = Random(21);
    for _ in times(200_000) {
        let (x, y) = random.pair();
        for factor in [y.lower, y.upper, -y.upper, 0.0, -0.0, 1.0, f64::MIN_POSITIVE] {
            if factor.is_finite() {
                assert_eq!(x.scaled(factor), x * Interval::point(factor), "{x:?} * {factor:?}");
            }
        }
    }
}

#[test]
fn quotients() {
    /// `bound <= a / b` without a division.
    fn not_above_quotient(bound: f64, a: &Exact, b: &Exact) -> bool {
        if !bound.is_finite() {
            return bound == f64::NEG_INFINITY;
        }
        let product = &Exact::of(bound) * b;
        if b.sign() > 0 { product <= *a } else { product >= *a }
    }
    let mut random = Random(3);
    for _ in times(700_000) {
        let (x, y) = random.pair();
        let quotient = x / y;
        assert!(is_sane(quotient), "{x:?} {y:?}");
        if y.contains(0.0) {
            assert_eq!(quotient, Interval::ENTIRE);
            continue;
        }
        for (a, b) in random.point_pairs(x, y) {
            let (a, b) = (Exact::of(a), Exact::of(b));
            let inside = not_above_quotient(quotient.lower, &a, &b)
                && not_above_quotient(-quotient.upper, &-&a, &b);
            assert!(inside, "{x:?} / {y:?} = {quotient:?}");
        }
        if x.is_finite() && y.is_finite() {
            let (l, u) = inward(quotient, 4);
            let corners =
                [(x.lower, y.lower), (x.lower, y.upper), (x.upper, y.lower), (x.upper, y.upper)]
                    .map(|(a, b)| (Exact::of(a), Exact::of(b)));
            // l >= a / b is -l <= -a / b.
            let tight = corners.iter().any(|(a, b)| not_above_quotient(-l, &-a, b))
                && corners.iter().any(|(a, b)| not_above_quotient(u, a, b));
            assert!(tight, "{x:?} / {y:?} = {quotient:?}");
        }
    }
}

/// Whether a bound is within some rounding of both operations of the exact one; they overflow where
/// the product does.
fn is_near(result: Interval, product: (&Exact, &Exact), term: Interval) -> bool {
    let allowed = Exact::new(BigInt::from(8), -52);
    let smallest = Exact::new(BigInt::from(8), -1074);
    let near = |bound: f64, product: &Exact, term: f64| {
        let exact = product + &Exact::of(term);
        let most = product.clone().abs().max(exact.clone().abs());
        if most.size() > 1020 {
            return true;
        }
        bound.is_finite() && (&Exact::of(bound) - &exact).abs() <= &(&most * &allowed) + &smallest
    };
    near(result.lower, product.0, term.lower) && near(result.upper, product.1, term.upper)
}

#[test]
fn products_with_a_term() {
    let mut random = Random(4);
    for _ in times(400_000) {
        let (x, y) = random.pair();
        let z = match random.below(3) {
            0 => random.interval(),
            1 => {
                let product = -x.upper * y.upper;
                let start = if product.is_finite() { product } else { 1.0 };
                random.around(start)
            }
            _ => {
                let value = random.partner(x.midpoint() * 1e-3);
                random.around(value)
            }
        };
        let (result, square) = (x.mul_add(y, z), x.square_plus(z));
        assert!(is_sane(result) && is_sane(square), "{x:?} {y:?} {z:?}");
        let ends = random.points(z).map(Exact::of);
        for (k, (a, b)) in random.point_pairs(x, y).into_iter().enumerate() {
            let (a, b, c) = (Exact::of(a), Exact::of(b), &ends[k % 3]);
            // The corners of the product with both ends of the term.
            let (product, squared) = (&a * &b, &a * &a);
            for c in [c, &ends[(k + 1) % 3]] {
                assert!(holds(result, &(&product + c)), "{x:?} * {y:?} + {z:?} = {result:?}");
                assert!(holds(square, &(&squared + c)), "{x:?}^2 + {z:?} = {square:?}");
            }
        }
        if x.is_finite() && y.is_finite() && z.is_finite() {
            let (lower, upper) = exact_products(x, y);
            assert!(is_near(result, (&lower, &upper), z), "{x:?} * {y:?} + {z:?} = {result:?}");
            let (lower, upper) = exact_squares(x);
            assert!(is_near(square, (&lower, &upper), z), "{x:?}^2 + {z:?} = {square:?}");
        }
    }
}

/// The least and the greatest square of a finite interval.
fn exact_squares(x: Interval) -> (Exact, Exact) {
    let (a, b) = (Exact::of(x.lower), Exact::of(x.upper));
    let (a, b) = (&a * &a, &b * &b);
    let lower = if x.contains(0.0) { Exact::of(0.0) } else { a.clone().min(b.clone()) };
    (lower, a.max(b))
}

#[test]
fn squares_and_roots() {
    /// The square of a bound that is not negative, compared with `value`.
    fn square_order(bound: f64, value: &Exact) -> Ordering {
        if bound.is_infinite() {
            return Ordering::Greater;
        }
        let bound = Exact::of(bound);
        (&bound * &bound).partial_cmp(value).unwrap()
    }
    let mut random = Random(5);
    for _ in times(700_000) {
        let x = random.interval();
        let (square, root) = (x.square(), x.sqrt());
        assert!(is_sane(square) && is_sane(root) && square.lower >= 0.0, "{x:?}");
        for a in random.points(x) {
            let a = Exact::of(a);
            assert!(holds(square, &(&a * &a)), "{x:?}^2 = {square:?}");
            if a.sign() >= 0 {
                let not_above = square_order(root.lower, &a) != Ordering::Greater;
                let not_below = square_order(root.upper, &a) != Ordering::Less;
                assert!(root.lower >= 0.0 && not_above && not_below, "sqrt {x:?} = {root:?}");
            }
        }
        if x.upper < 0.0 {
            assert_eq!(root, Interval::ENTIRE);
        }
        if x.is_finite() {
            let (lower, upper) = exact_squares(x);
            assert!(is_tight(square, &lower, &upper), "{x:?}^2 = {square:?}");
            assert!(lower.sign() != 0 || square.lower == 0.0, "{x:?}^2 = {square:?}");
            assert!(upper.sign() != 0 || square.upper == 0.0, "{x:?}^2 = {square:?}");
        }
        if x.is_finite() && x.upper >= 0.0 {
            let (l, u) = inward(root, 4);
            let (lower, upper) = (Exact::of(x.lower.max(0.0)), Exact::of(x.upper));
            let tight = (root.lower == 0.0 && lower.sign() == 0
                || square_order(l, &lower) != Ordering::Less)
                && (u <= 0.0 || square_order(u, &upper) != Ordering::Greater);
            assert!(tight, "sqrt {x:?} = {root:?}");
        }
    }
}

// ---- angles ----

/// Digits after the binary point of the numbers below.
const DIGITS: i64 = 240;

/// pi, by Machin's formula.
static PI_DIGITS: LazyLock<BigInt> = LazyLock::new(|| {
    let guard = 40;
    let one = BigInt::from(1) << (DIGITS + guard) as usize;
    let arctangent_of_inverse = |n: u32| {
        let (mut sum, mut power) = (BigInt::from(0), &one / n);
        for k in 0..DIGITS + guard {
            let term = &power / (2 * k + 1);
            sum = if k % 2 == 0 { sum + term } else { sum - term };
            power /= n * n;
        }
        sum
    };
    (16 * arctangent_of_inverse(5) - 4 * arctangent_of_inverse(239)) >> guard as usize
});

/// Least and greatest possible value.
type Range = (Exact, Exact);

fn sum_of_products(a: &Range, x: &Exact, b: &Range, y: &Exact) -> Range {
    let product = |range: &Range, factor: &Exact| {
        let (low, high) = (&range.0 * factor, &range.1 * factor);
        if factor.sign() < 0 { (high, low) } else { (low, high) }
    };
    let (a, b) = (product(a, x), product(b, y));
    (&a.0 + &b.0, &a.1 + &b.1)
}

/// Sine and cosine of a number of at most 2^21, to 200 digits after the point; of a small one to 100
/// of its own.
fn exact_sin_cos(angle: f64) -> (Range, Range) {
    let exact = Exact::of(angle);
    if angle.abs() < 2f64.powi(-60) {
        // The sine is nearer to zero than the angle, by less than the angle's cube; the cosine is
        // below one by less than the square.
        let (one, square) = (Exact::of(1.0), &exact * &exact);
        let nearer = &exact - &(&exact * &square);
        return ((nearer.clone().min(exact.clone()), nearer.max(exact)), (&one - &square, one));
    }
    let fixed: BigInt = exact.digits << (DIGITS + exact.exponent) as usize;
    // Within an eighth of a turn of a multiple of a quarter turn.
    let quarter: BigInt = &*PI_DIGITS >> 1;
    let twice: BigInt = 2 * &fixed + &quarter;
    let mut quarters: BigInt = &twice / &*PI_DIGITS; // towards zero
    if twice.sign() == Sign::Minus {
        quarters -= 1;
    }
    let rest: BigInt = fixed - ((&*PI_DIGITS * &quarters) >> 1usize);
    let square: BigInt = (&rest * &rest) >> DIGITS as usize;
    let one = BigInt::from(1) << DIGITS as usize;
    let series = |first: BigInt, mut k: u32| {
        let (mut sum, mut term) = (first.clone(), first);
        while term.sign() != Sign::NoSign {
            term = -((&term * &square) >> DIGITS as usize) / ((k + 1) * (k + 2));
            sum += &term;
            k += 2;
        }
        sum
    };
    let (sine, cosine) = (series(rest, 1), series(one, 0));
    let quadrant = i64::try_from(quarters).unwrap().rem_euclid(4);
    let (sine, cosine) = match quadrant {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    };
    // What rounding of 2^21 / pi multiples of pi and of some 50 terms can make.
    let doubt = BigInt::from(1) << (DIGITS - 200) as usize;
    let range =
        |value: BigInt| (Exact::new(&value - &doubt, -DIGITS), Exact::new(value + &doubt, -DIGITS));
    (range(sine), range(cosine))
}

#[test]
fn the_exact_sines_are_right() {
    // pi to 230 digits lies between neighbouring doubles, and its sine there is the rest.
    let ((low, high), _) = exact_sin_cos(PI);
    let rest: f64 = 1.2246467991473532e-16;
    assert!(not_above(rest.next_down(), &low) && not_below(rest.next_up(), &high));
    let mut random = Random(6);
    for _ in times(5_000) {
        let angle = random.sign() * 1e6 * random.share().powi(4);
        let (sine, cosine) = exact_sin_cos(angle);
        for (range, value) in [(sine, angle.sin()), (cosine, angle.cos())] {
            let (down, up) = (value - 1e-15 * value.abs(), value + 1e-15 * value.abs());
            assert!(not_above(down, &range.0) && not_below(up, &range.1), "{angle}");
        }
    }
}

/// How many doubles apart the bounds are.
fn doubles_between(x: Interval) -> i128 {
    place(x.upper) - place(x.lower)
}

#[test]
fn sines_and_cosines() {
    let mut random = Random(7);
    for k in times(80_000) {
        let x = match random.below(4) {
            0 => random.interval(),
            1 => {
                let (a, b) = (20.0 * random.share() - 10.0, 10.0 * random.share().powi(4));
                Interval::new(a, a + b)
            }
            2 => {
                let value = random.sign() * 10f64.powf(9.0 * random.share() - 2.5);
                random.around(value)
            }
            _ => {
                // About a multiple of a quarter turn, up to where nothing is computed any more.
                let many = if random.below(2) == 0 { 10 } else { 640_000 };
                let (centre, reach) = (random.below(many) as f64 * FRAC_PI_2, random.below(5));
                let radius = 10f64.powf(-20.0 * random.share());
                let start = random.sign() * centre;
                match reach {
                    0 => Interval::point(start),
                    1 => Interval::new(start, start + radius),
                    2 => Interval::new(start - radius, start),
                    3 => Interval::new(start.next_down(), start.next_up()),
                    _ => Interval::new(start - radius, start + radius * random.share()),
                }
            }
        };
        let (sine, cosine) = x.sin_cos();
        assert!(is_sane(sine) && is_sane(cosine), "{x:?}");
        for range in [sine, cosine] {
            assert!(range.lower >= -1.0 && range.upper <= 1.0, "{x:?}");
        }
        // The ends, one inside, and a double next to a multiple of a quarter turn inside.
        let [a, b, c] = random.points(x);
        let quarter = (a / FRAC_PI_2).ceil() + random.below(4) as f64;
        let turn = quarter * FRAC_PI_2;
        for a in [a, b, c, if x.contains(turn) { turn } else { c }] {
            if a.abs() > 1e6 {
                assert_eq!((sine, cosine), (Interval::new(-1.0, 1.0), Interval::new(-1.0, 1.0)));
                continue;
            }
            let (s, c) = exact_sin_cos(a);
            assert!(holds(sine, &s.0) && holds(sine, &s.1), "sin {x:?} = {sine:?} at {a}");
            assert!(holds(cosine, &c.0) && holds(cosine, &c.1), "cos {x:?} = {cosine:?} at {a}");
        }
        if k % 4 == 0 && a.abs() < 1e6 {
            let (sine, cosine) = Interval::point(a).sin_cos();
            if cosine.upper < 1.0 && sine.upper.abs() < 1.0 {
                assert!(doubles_between(sine) < 40 && doubles_between(cosine) < 40, "{a}");
            }
        }
    }
    // The range of a quarter turn is not wider for the quarters beside it.
    let (sine, cosine) = Interval::new(0.1, 1.5).sin_cos();
    assert!(doubles_between(Interval::new(sine.lower, 0.1f64.sin())) < 20);
    assert!(doubles_between(Interval::new(1.5f64.sin(), sine.upper)) < 20);
    assert!(doubles_between(Interval::new(cosine.lower, 1.5f64.cos())) < 20);
    assert!(doubles_between(Interval::new(0.1f64.cos(), cosine.upper)) < 20);
}

/// Whether `bound` is at most the angle of the point (x, y) in (-pi, pi].
fn not_above_angle(bound: f64, y: f64, x: f64) -> bool {
    // The double `PI` is below pi and its neighbour above: nothing lies between them.
    if !(-PI..=PI).contains(&bound) {
        return bound < -PI;
    }
    if y == 0.0 {
        return x < 0.0 || bound <= 0.0;
    }
    if (y > 0.0) != (bound > 0.0) {
        return y > 0.0;
    }
    if bound == 0.0 {
        return false;
    }
    // Both are in the same half turn, so the sign of the sine of their difference tells.
    let (sine, cosine) = exact_sin_cos(bound);
    let (x, y) = (Exact::of(x), Exact::of(y));
    sum_of_products(&cosine, &y, &sine, &-&x).0.sign() >= 0
}

fn not_below_angle(bound: f64, y: f64, x: f64) -> bool {
    // Mirrored, but the cut is pi.
    if y == 0.0 && x < 0.0 { bound > PI } else { not_above_angle(-bound, -y, x) }
}

#[test]
fn angles() {
    let mut random = Random(8);
    for k in times(80_000) {
        let (y, x) = if random.below(3) == 0 {
            let (b, a) = (2.0 * random.share() - 1.0, 2.0 * random.share() - 1.0);
            let width = 0.5 * random.share().powi(8);
            (Interval::new(b, b + width), Interval::new(a, a + width))
        } else {
            random.pair()
        };
        let angle = y.atan2(x);
        assert!(is_sane(angle), "atan2 {y:?} {x:?}");
        assert!(angle.lower >= (-PI).next_down() && angle.upper <= PI.next_up(), "{y:?} {x:?}");
        for (b, a) in random.point_pairs(y, x) {
            if a != 0.0 || b != 0.0 {
                let inside =
                    not_above_angle(angle.lower, b, a) && not_below_angle(angle.upper, b, a);
                assert!(inside, "atan2 {y:?} {x:?} = {angle:?} at {b} {a}");
            }
        }
        // Thin ones stay thin wherever the cut and the origin are not.
        let (b, a) = (random.number(), random.number());
        if k % 4 == 0 && b != 0.0 {
            let angle = Interval::point(b).atan2(Interval::point(a));
            assert!(doubles_between(angle) < 40, "atan2 {b} {a} = {angle:?}");
        }
    }
    // Every quadrant's angles are those of its corners.
    for (y, x, lower, upper) in [
        ((0.0, 1.0), (0.5, 1.0), 0.0, 2f64.atan()),
        ((1.0, 2.0), (-1.0, 1.0), 1f64.atan(), PI - 1f64.atan()),
        ((0.5, 1.0), (-2.0, -1.0), 1f64.atan2(-1.0), 0.5f64.atan2(-2.0)),
        ((-1.0, -0.5), (-2.0, -1.0), -(0.5f64.atan2(-2.0)), -(1f64.atan2(-1.0))),
        ((-2.0, -1.0), (-1.0, 1.0), -(1f64.atan2(-1.0)), -(1f64.atan())),
        ((-1.0, -0.5), (1.0, 2.0), -(1f64.atan()), -(0.25f64.atan())),
        ((-1.0, 2.0), (0.5, f64::INFINITY), -(2f64.atan()), 4f64.atan()),
        ((1.0, f64::INFINITY), (f64::NEG_INFINITY, f64::INFINITY), 0.0, PI),
    ] {
        let angle = Interval::new(y.0, y.1).atan2(Interval::new(x.0, x.1));
        assert!((angle.lower - lower).abs() < 1e-14, "{y:?} {x:?} {angle:?}");
        assert!((angle.upper - upper).abs() < 1e-14, "{y:?} {x:?} {angle:?}");
    }
}

// ---- the rest ----

#[test]
fn signs_choices_and_hulls() {
    let mut random = Random(9);
    for _ in times(700_000) {
        let (x, y) = random.pair();
        let hull = x.hull(y);
        assert!(is_sane(-x) && is_sane(hull));
        assert_eq!(-(-x), x);
        for (a, b) in random.point_pairs(x, y) {
            assert!((-x).contains(-a) && hull.contains(a) && hull.contains(b));
            let chosen = a.select(a, b);
            assert!(x.select(x, y).contains(chosen), "{x:?} {y:?} {a} {b}");
        }
        assert!(hull.lower == x.lower || hull.lower == y.lower);
        assert!(hull.upper == x.upper || hull.upper == y.upper);
        if x.lower >= 0.0 {
            assert_eq!(x.select(x, y), x);
        }
        if x.upper < 0.0 {
            assert_eq!(x.select(x, y), y);
        }
    }
}

#[test]
fn middles_distances_and_common_parts() {
    let mut random = Random(10);
    for _ in times(500_000) {
        let (x, y) = random.pair();
        let (middle, radius, magnitude) = (x.midpoint(), x.radius(), x.magnitude());
        assert!(middle.is_finite() && x.contains(middle), "{x:?}");
        assert_eq!(x.is_finite(), x.lower.is_finite() && x.upper.is_finite());
        assert_eq!(magnitude, x.lower.abs().max(x.upper.abs()), "{x:?}");
        if x.is_finite() {
            let [lower, upper, centre] = [x.lower, x.upper, middle].map(Exact::of);
            let farthest = (&centre - &lower).max(&upper - &centre);
            assert!(not_below(radius, &farthest), "{x:?}");
            let (inward, _) = (0..4).fold((radius, 0), |(r, _), _| (r.next_down(), 0));
            assert!(radius == 0.0 || not_above(inward, &farthest), "{x:?}");
            // The middle is within a step of the exact one.
            let twice = &(&centre + &centre) - &(&lower + &upper);
            let step = &Exact::of(magnitude.max(f64::MIN_POSITIVE)) * &Exact::of(f64::EPSILON);
            assert!(twice.abs() <= &step + &step, "{x:?}");
        } else {
            assert_eq!(radius, f64::INFINITY);
        }
        assert!(x.lower < x.upper || radius == 0.0);
        let common = x.intersection(y);
        for (a, b) in random.point_pairs(x, y) {
            for value in [a, b] {
                let both = x.contains(value) && y.contains(value);
                assert_eq!(both, common.is_some_and(|common| common.contains(value)));
            }
        }
        match common {
            Some(common) => {
                assert!(is_sane(common));
                assert!(common.hull(x) == x && common.hull(y) == y);
                assert!(!common.is_inside(common));
            }
            None => assert!(x.upper < y.lower || y.upper < x.lower),
        }
        assert_eq!(x.is_inside(y), y.lower < x.lower && x.upper < y.upper);
        let ball = Interval::symmetric(magnitude);
        assert!(is_sane(ball) && ball.hull(x) == ball && ball == -ball);
        assert_eq!(ball, Interval::symmetric(-magnitude));
    }
}

#[test]
fn what_is_no_number_is_no_bound() {
    const ODD: [f64; 9] =
        [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.0, 5e-324, -1.5, 3.0, f64::MAX];
    let quiet = f64::from_bits(u64::MAX >> 1); // the step upward from this one would be -0
    let bounds = || ODD.into_iter().chain([-f64::NAN, quiet, -quiet, f64::MIN, -3.0, 2.0]);
    let mut all = Vec::new();
    for lower in bounds() {
        for upper in bounds() {
            if !(lower > upper) {
                // As somebody might write it, and as it is made.
                let (raw, made) = (Interval { lower, upper }, Interval::new(lower, upper));
                assert!(is_sane(made), "{raw:?}");
                all.push((raw, made));
            }
        }
    }
    let points = [-1e308, -3.0, -2.0, -1.5, -1e-300, 0.0, 5e-324, 2.0, 3.0, 1e308];
    for &(x, real_x) in &all {
        assert!(is_sane(x.square()) && is_sane(x.sqrt()), "{x:?}");
        assert!(is_sane(x.sin_cos().0) && is_sane(x.sin_cos().1), "{x:?}");
        assert!(real_x.contains(x.midpoint()) && !x.magnitude().is_nan() && x.radius() >= 0.0);
        for &(y, real_y) in &all {
            let results = [
                (x + y, (|a, b| a + b) as fn(f64, f64) -> f64),
                (x - y, |a, b| a - b),
                (x * y, |a, b| a * b),
                (x / y, |a, b| a / b),
                (x.mul_add(y, x), |a, b| a * b + a),
                (x.square(), |a, _| a * a),
                (x.square_plus(y), |a, b| a * a + b),
                (x.sqrt(), |a, _| a.max(0.0).sqrt()),
                (x.sin_cos().0, |a, _| a.sin()),
                (x.sin_cos().1, |a, _| a.cos()),
                (x.atan2(y), |a, b| a.atan2(b)),
                (x.hull(y), |a, _| a),
                (x.hull(y), |_, b| b),
                (x.select(x, y), |a, b| if a >= 0.0 { a } else { b }),
            ];
            for (k, (result, of)) in results.into_iter().enumerate() {
                // Hull and choice pass bounds on as they are.
                assert!(k > 10 || is_sane(result), "{k}: {x:?} {y:?} {result:?}");
                for a in points.into_iter().filter(|&a| real_x.contains(a)) {
                    for b in points.into_iter().filter(|&b| real_y.contains(b)) {
                        let value = of(a, b);
                        let free = value.is_nan() || result.contains(value);
                        let passed = k == 13 && (result.lower.is_nan() || result.upper.is_nan());
                        assert!(free || passed, "{k}: {x:?} {y:?} {result:?} at {a} {b}");
                    }
                }
            }
        }
    }
    assert_eq!(Interval::point(f64::NAN), Interval::ENTIRE);
    assert_eq!(Interval::point(f64::INFINITY), Interval::new(f64::MAX, f64::INFINITY));
    assert_eq!(Interval::symmetric(f64::NAN), Interval::ENTIRE);
    assert_eq!(Interval::symmetric(f64::INFINITY), Interval::ENTIRE);
}
