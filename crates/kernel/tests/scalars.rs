//! One generic closure serves all six scalars.

use std::path::Path;
use std::process::Command;
use truepose_kernel::element::guide::{GuideFrames, GuideLimb};
use truepose_kernel::element::{Direction, DriveKind, GuideKind, ParameterGradient, strut};
use truepose_kernel::scalar::{AffineForm, Dual, Interval, LANES, Lanes, Scalar, Tape, Trace};
use truepose_kernel::spatial::{quaternion_from_euler, rotation_matrix};

type Many = Lanes<{ truepose_kernel::dispatch::PORTABLE }>;

/// Numbers of the closures below: base (3), platform (3), length, drive parameters (7), joint.
const INPUTS: usize = 15;

/// The drives with an axis.
const DRIVES: [DriveKind; 2] = [DriveKind::Slider, DriveKind::Crank];

/// Every kind of closure that the elements make.
#[derive(Clone, Copy, Debug)]
enum Closure {
    /// A strut on a drive with an axis: everything that a drive reads.
    Driven(DriveKind),
    /// A strut whose platform-side joint slides on a ring.
    Ring,
    /// One closure of a guide.
    Guide(GuideKind, usize),
}

fn residual<S: Scalar>(closure: Closure, frame: &Direction, x: &[S; INPUTS]) -> S {
    match closure {
        Closure::Driven(kind) => {
            let (centre, length) = kind.place(frame, &x[7..14], x[14], [x[0], x[1], x[2]], x[6]);
            strut::closure(centre, [x[3], x[4], x[5]], length)
        }
        Closure::Ring => {
            let (base, centre) = ([x[0], x[1], x[2]], [x[3], x[4], x[5]]);
            let axis = frame.tilted(x[10], x[11]);
            let (nearest, _) = strut::nearest_on_ring(centre, axis, x[7], base);
            strut::closure(base, nearest, x[6])
        }
        Closure::Guide(kind, which) => {
            let frames = GuideFrames { frame: *frame, platform: Direction::new([0.9, 0.3, -0.1]) };
            let limb = GuideLimb {
                frame_point: [x[0], x[1], x[2]],
                arm: [x[3], x[4], x[5]],
                tilts: [[x[7], x[8]], [x[9], x[10]]],
            };
            let angles = [0.3, -0.2, 0.5].map(|angle| x[0].lift(angle));
            let rotation = rotation_matrix(quaternion_from_euler(angles));
            kind.residual(which, &frames, &limb, (&rotation, [x[11], x[12], x[13]]), 0.7)
        }
    }
}

fn kinds() -> Vec<Closure> {
    let drives = DRIVES.map(Closure::Driven);
    let guides = GuideKind::ALL
        .iter()
        .flat_map(|&kind| (0..kind.closures()).map(move |which| Closure::Guide(kind, which)));
    drives.into_iter().chain([Closure::Ring]).chain(guides).collect()
}

fn frame() -> Direction {
    Direction::new([0.2, -0.5, 0.9])
}

/// Samples of the inputs, the same everywhere.
fn samples(count: usize) -> Vec<[f64; INPUTS]> {
    let mut state = 7_u64;
    let mut next = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let middle =
        [0.3, 0.1, -0.2, 0.4, 0.5, -0.9, 0.8, 0.05, 0.1, -0.1, 0.02, -0.03, 0.01, 1.01, 0.4];
    (0..count).map(|_| middle.map(|value| value + 0.1 * (next() - 0.5))).collect()
}

#[test]
fn lanes_give_the_numbers_of_f64() {
    for kind in kinds() {
        let many = samples(LANES);
        let lanes: [Many; INPUTS] =
            std::array::from_fn(|i| Lanes(std::array::from_fn(|k| many[k][i])));
        let result = residual(kind, &frame(), &lanes);
        for k in 0..LANES {
            let single = residual(kind, &frame(), &many[k]);
            assert!((result.0[k] - single).abs() < 1e-15, "{kind:?} lane {k}");
        }
    }
}

#[test]
fn dual_derivatives_equal_central_differences() {
    for kind in kinds() {
        for x in samples(20) {
            let dual: [Dual<f64, INPUTS>; INPUTS] =
                std::array::from_fn(|i| Dual::variable(x[i], i));
            let result = residual(kind, &frame(), &dual);
            for i in 0..INPUTS {
                let (mut above, mut below) = (x, x);
                above[i] += 1e-6;
                below[i] -= 1e-6;
                let difference =
                    (residual(kind, &frame(), &above) - residual(kind, &frame(), &below)) / 2e-6;
                assert!((result.parts[i] - difference).abs() < 1e-9, "{kind:?} input {i}");
            }
        }
    }
}

#[test]
fn the_gradient_that_kinematics_uses_is_the_dual_one() {
    for kind in DRIVES {
        for x in samples(20) {
            let dual: [Dual<f64, INPUTS>; INPUTS] =
                std::array::from_fn(|i| Dual::variable(x[i], i));
            let expected = residual(Closure::Driven(kind), &frame(), &dual).parts;
            let mut slots = ParameterGradient::default();
            let points = [[x[0], x[1], x[2]], [x[3], x[4], x[5]]];
            let gradient = kind.gradient(&frame(), &x[7..14], x[14], points, x[6], &mut slots);
            let derivatives: Vec<f64> = slots[..3]
                .iter()
                .chain(&gradient.centre)
                .chain(&slots[6..14])
                .chain([&gradient.joint])
                .copied()
                .collect();
            for i in 0..INPUTS {
                assert!((derivatives[i] - expected[i]).abs() < 1e-14, "{kind:?} input {i}");
            }
        }
    }
}

#[test]
fn an_interval_result_contains_samples() {
    for kind in kinds() {
        let many = samples(2000);
        let boxed: [Interval; INPUTS] = std::array::from_fn(|i| {
            let values = many.iter().map(|x| x[i]);
            let lower = values.clone().fold(f64::INFINITY, f64::min);
            Interval::new(lower, values.fold(f64::NEG_INFINITY, f64::max))
        });
        let result = residual(kind, &frame(), &boxed);
        assert!(result.upper - result.lower < 10.0, "an empty statement: {result:?}");
        for x in &many {
            assert!(result.contains(residual(kind, &frame(), x)), "{kind:?}");
        }
    }
}

/// The inputs over a box of three variables, each moved by all of them, `size` wide.
fn formed(at: &[f64; INPUTS], size: f64) -> [AffineForm<3>; INPUTS] {
    std::array::from_fn(|i| {
        let rates = [0, 1, 2].map(|k| Interval::point(size * input_slope(i, k)));
        AffineForm::of_rates(Interval::point(at[i]), &rates, Interval::ENTIRE)
    })
}

fn input_slope(input: usize, variable: usize) -> f64 {
    ((input * 3 + variable) as f64 * 1.7).sin()
}

#[test]
fn an_affine_form_contains_samples_and_is_off_by_second_order() {
    for kind in kinds() {
        for x in samples(20) {
            let mut widths = Vec::new();
            for size in [1e-2, 1e-3] {
                let result = residual(kind, &frame(), &formed(&x, size));
                for e in samples(100) {
                    let e = [0, 1, 2].map(|k| ((e[k] * 1e6).sin() * 1.5).clamp(-1.0, 1.0));
                    let moved: [f64; INPUTS] = std::array::from_fn(|i| {
                        x[i] + (0..3).map(|k| size * input_slope(i, k) * e[k]).sum::<f64>()
                    });
                    let value = residual(kind, &frame(), &moved);
                    let linear =
                        result.middle + (0..3).map(|k| result.slopes[k] * e[k]).sum::<f64>();
                    // `moved` and `linear` are rounded, too.
                    assert!((value - linear).abs() <= result.rest + 1e-14, "{kind:?} {size}");
                    assert!(result.range.lower - 1e-14 <= value, "{kind:?} {size}");
                    assert!(value <= result.range.upper + 1e-14, "{kind:?} {size}");
                }
                widths.push(result.rest);
            }
            // Of a tenth of the box a hundredth, and what rounding leaves.
            assert!(widths[1] < 0.012 * widths[0] + 1e-13, "{kind:?} {widths:?}");
        }
    }
}

#[test]
fn the_mean_of_an_affine_form_over_the_way_contains_that_of_samples() {
    const SIZE: f64 = 1e-2;
    // Gauss's rule with three points.
    let points = [(0.5 - 0.15_f64.sqrt(), 5.0), (0.5, 8.0), (0.5 + 0.15_f64.sqrt(), 5.0)];
    for kind in kinds() {
        for x in samples(20) {
            let whole = residual(kind, &frame(), &formed(&x, SIZE));
            let mean = whole.mean_from_middle();
            for e in [[1.0, -1.0, 1.0], [-1.0, -1.0, -1.0], [0.0, 1.0, 0.3]] {
                let at = |share: f64| -> f64 {
                    let moved: [f64; INPUTS] = std::array::from_fn(|i| {
                        x[i] + (0..3).map(|k| share * SIZE * input_slope(i, k) * e[k]).sum::<f64>()
                    });
                    residual(kind, &frame(), &moved)
                };
                let value = points.iter().map(|&(share, weight)| weight * at(share)).sum::<f64>();
                let linear = mean.middle + (0..3).map(|k| mean.slopes[k] * e[k]).sum::<f64>();
                assert!((value / 18.0 - linear).abs() <= mean.rest + 1e-9, "{kind:?}");
                assert!(mean.range.hull(whole.range) == whole.range, "{kind:?}");
            }
            // As exact as the whole: a form that is wider would contain anything.
            assert!(mean.rest <= whole.rest * (1.0 + 1e-12) + 1e-300, "{kind:?}");
        }
    }
    let one = AffineForm::<3>::variable(1);
    assert_eq!((one.middle, one.slopes, one.rest), (0.0, [0.0, 1.0, 0.0], 0.0));
    assert_eq!(one.range, Interval::new(-1.0, 1.0));
}

#[test]
fn an_affine_form_lies_within_the_interval() {
    for kind in kinds() {
        for x in samples(20) {
            let forms = formed(&x, 0.01);
            let boxed: [Interval; INPUTS] = std::array::from_fn(|i| forms[i].range);
            let (form, interval) =
                (residual(kind, &frame(), &forms).range, residual(kind, &frame(), &boxed));
            assert!(interval.hull(form) == interval, "{kind:?} {form:?} {interval:?}");
            assert!(form.radius() < 0.9 * interval.radius(), "{kind:?} {form:?} {interval:?}");
        }
    }
}

#[test]
fn an_affine_form_without_a_number_is_what_the_interval_is() {
    let whole = AffineForm::<2>::from_interval(Interval::ENTIRE);
    let wide = AffineForm::<2>::from_interval(Interval::new(-1.0, 2.0));
    let one = wide.lift(1.0);
    for (form, expected) in [
        (whole * wide, Interval::ENTIRE),
        (one / wide, Interval::ENTIRE),
        (whole.square(), Interval::new(0.0, f64::INFINITY)),
        (wide.sqrt(), wide.range.sqrt()),
        ((-one).sqrt(), Interval::ENTIRE),
        (whole.sin_cos().0, Interval::new(-1.0, 1.0)),
        (one.atan2(whole), one.range.atan2(Interval::ENTIRE)),
        (wide.select(one, -one), Interval::new(-1.0, 1.0)),
        (one.lift(f64::NAN), Interval::ENTIRE),
        (one / whole, Interval::ENTIRE),
    ] {
        assert_eq!(form.range, expected);
    }
    let zero = one.lift(0.0);
    for still in [zero + zero, zero * wide, zero.scaled(3.0), zero / one] {
        assert_eq!((still.range, still.rest), (Interval::point(0.0), 0.0));
    }
}

#[test]
fn a_traced_closure_prints_c_that_equals_f64() {
    let Ok(version) = Command::new("cc").arg("--version").output() else {
        assert!(std::env::var_os("TRUEPOSE_CI").is_none(), "no C compiler");
        eprintln!("skipped: no C compiler");
        return;
    };
    assert!(version.status.success());
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    for (number, kind) in kinds().into_iter().enumerate() {
        let tape = Tape::new();
        let inputs: [Trace<'_>; INPUTS] = std::array::from_fn(|i| tape.input(format!("x[{i}]")));
        let output = residual(kind, &frame(), &inputs);
        let (body, _) = tape.print_c(&[("y[0]".to_string(), output)]);
        let function = format!("static void closure(const double *x, double *y)\n{{\n{body}}}\n");
        let many = samples(50);
        let rows: Vec<String> = many
            .iter()
            .map(|x| {
                let numbers: Vec<String> = x.iter().map(|value| format!("{value:?}")).collect();
                format!("{{{}}}", numbers.join(", "))
            })
            .collect();
        let code = format!(
            "#include <math.h>\n#include <stdio.h>\n{function}\
             static const double rows[][{INPUTS}] = {{{}}};\n\
             int main(void) {{ for (int i = 0; i < {}; i++) {{ double y; closure(rows[i], &y); \
             printf(\"%a\\n\", y); }} return 0; }}\n",
            rows.join(",\n"),
            many.len()
        );
        let source = folder.join(format!("closure{number}.c"));
        let program = folder.join(format!("closure{number}"));
        std::fs::write(&source, code).unwrap();
        let compiled = Command::new("cc")
            .args(["-std=c99", "-O1", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic"])
            .args(["-Werror"])
            .args([&source, Path::new("-o"), &program, Path::new("-lm")])
            .output()
            .unwrap();
        assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
        let printed = Command::new(&program).output().unwrap();
        let lines = String::from_utf8(printed.stdout).unwrap();
        assert_eq!(lines.lines().count(), many.len());
        for (line, x) in lines.lines().zip(&many) {
            let expected = residual(kind, &frame(), x);
            let printed = hexadecimal(line);
            assert!(
                (printed - expected).abs() <= 2.0 * f64::EPSILON,
                "{kind:?}: {line} {expected}"
            );
        }
    }
}

/// The value of C's `%a`: sign, 0x, mantissa with a point, p, exponent.
fn hexadecimal(text: &str) -> f64 {
    let (sign, text) = text.strip_prefix('-').map_or((1.0, text), |rest| (-1.0, rest));
    let (mantissa, exponent) = text.trim_start_matches("0x").split_once('p').unwrap();
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = u64::from_str_radix(&format!("{whole}{fraction}"), 16).unwrap();
    let shift = exponent.parse::<i32>().unwrap() - 4 * fraction.len() as i32;
    sign * digits as f64 * 2.0_f64.powi(shift)
}

#[test]
fn the_closed_form_inverse_gives_back_the_joint() {
    for kind in DRIVES {
        for x in samples(200) {
            let (centre, _) = kind.place(&frame(), &x[7..14], x[14], [x[0], x[1], x[2]], x[6]);
            let platform = [x[3], x[4], x[5]];
            let length = truepose_kernel::spatial::norm([0, 1, 2].map(|k| platform[k] - centre[k]));
            let base = [x[0], x[1], x[2]];
            let closest = [1.0, -1.0]
                .map(|mode| {
                    let reach = kind.inverse(&frame(), &x[7..14], mode, base, length, platform);
                    assert!(reach.margin >= 0.0);
                    (reach.joint - x[14]).abs()
                })
                .into_iter()
                .fold(f64::INFINITY, f64::min);
            assert!(closest < 1e-9, "{kind:?} {closest}");
            let [least, most] = kind.span(&frame(), &x[7..14], base, platform);
            assert!(least <= length * (1.0 + 1e-12) && length <= most * (1.0 + 1e-12));
        }
    }
}
