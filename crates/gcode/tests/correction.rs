//! Blocks written anew, each case as the lines that come out.

use truepose_gcode::{
    AXES, AxisSet, Corrector, Digits, Error, Kind, Move, PathMode, Position, Reader, Settings,
    WorkOffset,
};

/// What becomes of one move: its number of pieces, and what is added to X Y Z A B C at the end of each.
type Pieces = fn(&Move) -> (usize, [f64; 6]);

fn settings(axes: &str) -> Settings {
    let mut settings = Settings {
        start: [0.0; AXES],
        axes: AxisSet::from_letters(axes).unwrap(),
        block_delete: Some(false),
        ..Settings::default()
    };
    let mut origin = [0.0; AXES];
    origin[0] = 100.0;
    settings.offsets[1] = Some(WorkOffset { origin, rotation: 0.0 });
    settings
}

fn corrected(program: &str, axes: &str, pieces: Pieces) -> Result<String, Error> {
    written(
        Corrector::new(program.as_bytes(), Vec::new(), settings(axes), Digits::default()),
        pieces,
    )
}

fn written(mut corrector: Corrector<&[u8], Vec<u8>>, pieces: Pieces) -> Result<String, Error> {
    loop {
        let moves = corrector.read(3)?.to_vec();
        if moves.is_empty() {
            return Ok(String::from_utf8(corrector.finish()?).unwrap());
        }
        let (mut counts, mut points, mut shares) = (Vec::new(), Vec::new(), Vec::new());
        for motion in &moves {
            let (count, added) = pieces(motion);
            counts.push(count);
            for piece in 1..=count {
                let share = piece as f64 / count as f64;
                let mut point = motion.point(share);
                for (coordinate, added) in point.iter_mut().zip(added) {
                    *coordinate += added;
                }
                points.push(point);
                shares.push(share);
            }
        }
        corrector.write(&counts, &points, &shares)?;
    }
}

fn case(program: &str, expected: &str, pieces: Pieces) {
    assert_eq!(corrected(program, "XYZ", pieces).unwrap(), expected);
}

const SAME: Pieces = |_| (1, [0.0; 6]);
const TWO: Pieces = |_| (2, [0.0; 6]);
const UP: Pieces = |_| (1, [0.0, 0.0, 0.25, 0.0, 0.0, 0.0]);
const BESIDE: Pieces = |_| (1, [0.001, 0.0, 0.0, 0.0, 0.0, 0.0]);

#[test]
fn what_does_not_change_keeps_its_bytes() {
    let program = "%\n(head)\ng21 G90\n N10  g0\tX 1.50 (a) y2 ;b\r\nG1 Z-.5000 F1 00\nG91 X1e\n";
    let program = program.replace("X1e", "X1. M0");
    case(&program, &program, SAME);
    case("G21 G0 X1\nM2\nwhatever ( #\n", "G21 G0 X1\nM2\nwhatever ( #\n", SAME);
    // Below half of the last decimal nothing changes either.
    case("G21 G0 X1\n", "G21 G0 X1\n", |_| (1, [0.000_000_4, 0.0, 0.0, 0.0, 0.0, 0.0]));
}

#[test]
fn numbers_change_in_place_and_axes_are_added_behind_the_last() {
    case("G21\nN10 g0 x1.50 (a) Y2 M3 ; b\n", "G21\nN10 g0 x1.5 (a) Y2. Z0.25 M3 ; b\n", UP);
    case("G21\nN1G0X1Y2(c)\n", "G21\nN1G0X1.001Y2.(c)\n", BESIDE);
    // Z stands right from the first block on.
    case("G21 G0 X1\nX2\nX3 Z1\n", "G21 G0 X1. Z0.25\nX2\nX3. Z1.25\n", UP);
}

#[test]
fn divided_blocks_keep_their_words_in_the_first_piece_and_stops_in_the_last() {
    case(
        "G21 G1 X10 F100\r\nN5 X20 (c) M8 M0 S5 ; d\r\nM2\r\n",
        "G21 G1 X5. F100\r\nX10.\r\nM8\r\nN5 X15. (c) S5 ; d\r\nX20. M0\r\nM2\r\n",
        TWO,
    );
    case("G21 G0 X2M30", "G21 G0 X1.\nX2. M30", TWO);
    case("G21 G0X2Y2\n/X4\n", "G21 G0X1.Y1.\nX2.Y2.\n/X3.\n/X4.\n", TWO);
}

#[test]
fn inch_stays_inch() {
    case("G20 G0 X1\nG21 X50.8\n", "G20 G0 X0.5\nX1.\nG21 X38.1\nX50.8\n", TWO);
    case("G20 G0 X1\n", "G20 G0 X1.0000394\n", BESIDE);
}

#[test]
fn increments_do_not_drift() {
    let program = format!("G21 G91 G1 F10\n{}", "X.1\n".repeat(1000));
    let thirds: Pieces = |_| (3, [0.0; 6]);
    let written = corrected(&program, "XYZ", thirds).unwrap();
    assert!(written.starts_with("G21 G91 G1 F10\nX0.033333\nX0.033334\nX0.033333\nX0.033333\n"));
    let mut reader = Reader::new(written.as_bytes(), settings("XYZ"));
    let mut last = 0.0;
    while let Some(motion) = reader.next_move().unwrap() {
        last = motion.end[0];
    }
    assert!((last - 100.0).abs() <= 0.5e-6, "{last}");
    case("G21 G91 G0 X1\nX1\n", "G21 G91 G0 X1.001\nX1\n", BESIDE);
}

#[test]
fn offsets_and_machine_coordinates_are_kept_apart() {
    case(
        "G21 G55 G0 X1\nG53 G0 X2\nG53 G1 X4 F1\n",
        "G21 G55 G0 X-49.5\nX1.\nG53 G0 X51.5\nG53 X2.\nG53 G1 X3. F1\nG53 X4.\n",
        TWO,
    );
}

#[test]
fn arcs_become_lines_and_the_motion_code_is_restored() {
    case(
        "G21 G2 X10 I5 F100 (c)\nX20 I5 J0 P1\nN7 G3 X10 R5\nG1 X0\n",
        "G21 G1 X5. Y5. F100 (c)\nX10. Y0.\nX15. Y5.\nX20. Y0.\nN7 G1 X15. Y5.\nX10. Y0.\nG1 X5.\nX0.\n",
        TWO,
    );
    case("G21 G3 I5 F1\n", "G21 G1 X10. F1\nX0.\n", TWO);
    case("G21 G2 Z4 I5 F1 M0\n", "G21 G1 Z2. X10. F1\nX0. Z4. M0\n", TWO);
}

#[test]
fn inverse_time_is_shared_out() {
    case(
        "G21 G93 G1 X10 F2\nG2 X20 I5 F.5\nG0 X0 F3\n",
        "G21 G93 G1 X5. F4.\nX10. F4.\nG1 X15. Y5. F1.\nX20. Y0. F1.\nG0 X10. F3\nX0.\n",
        TWO,
    );
    case("G21 G93 G1 X10 F2.0\n", "G21 G93 G1 X10.001 F2.0\n", BESIDE);
}

#[test]
fn references_take_only_their_own_axes() {
    // Z is corrected before G28, which must not take it away.
    case(
        "G21 G1 X1 F10\nG28 X5 M0\nG0 X0\nG1 X1\n",
        "G21 G1 X1. Z0.25 F10\nG28 X5 M0\nG0 X0\nG1 X1\n",
        UP,
    );
    case(
        "G21 G1 X1 F10\nN3 G28 X5 M1\nG0 X0\n",
        "G21 G1 X0.5 F10\nX1.\nN3 G0 X3.\nX5.\nG28 X5. M1\nG0 X0\n",
        |motion| if motion.start[0].is_nan() { (1, [0.0; 6]) } else { (2, [0.0; 6]) },
    );
    case("G21 G91 G28 Z0\nG90 G0 Z1\n", "G21 G91 G28 Z0\nG90 G0 Z1\n", SAME);
    // The rapid of its own makes G1 go: it comes back.
    let up_at_five: Pieces = |motion| {
        let up = if motion.end[0] >= 5.0 { 0.25 } else { 0.0 };
        (1, [0.0, 0.0, up, 0.0, 0.0, 0.0])
    };
    let mut settings = settings("XYZ");
    settings.reference[0] = [0.0; AXES];
    let program = "G21 G1 X1 F10\nG91 G28 X4\nX6\n";
    let mut corrector = Corrector::new(program.as_bytes(), Vec::new(), settings, Digits::default());
    let moves = corrector.read(9).unwrap().to_vec();
    let points: Vec<Position> = moves
        .iter()
        .map(|motion| {
            let mut point = motion.end;
            point[2] += up_at_five(motion).1[2];
            point
        })
        .collect();
    corrector.write(&[1; 3], &points, &[1.0; 3]).unwrap();
    let written = String::from_utf8(corrector.finish().unwrap()).unwrap();
    assert_eq!(written, "G21 G1 X1 F10\nG91 G0 X4. Z0.25\nG28 X0\nG1 X6.\n");
}

#[test]
fn a_turn_keeps_its_time_where_the_correction_moves_the_tool() {
    let program = "G21 G0 A0\nG1 A10 F100 M0\nX5\n";
    let written = corrected(program, "XYZA", |motion| {
        let turns = motion.kind == Kind::Line && motion.stands_in_space();
        (1, [if turns { 0.002 } else { 0.0 }, 0.0, 0.0, 0.0, 0.0, 0.0])
    });
    assert_eq!(written.unwrap(), "G21 G0 A0\nG1 G93 A10. X0.002 F10.\nG94 F100. M0\nX5\n");
    let at_feed: Pieces = |motion| {
        (1, [if motion.kind == Kind::Line { 0.002 } else { 0.0 }, 0.0, 0.0, 0.0, 0.0, 0.0])
    };
    let per_revolution = corrected("G21 G0 A0\nG95 G1 A10 F1\n", "XYZA", at_feed).unwrap_err();
    assert!(matches!(per_revolution, Error::Refusal(refusal) if refusal.code == "gcode-division"));
}

#[test]
fn axes_that_are_not_corrected_go_along() {
    case("G21 G0 X2 A4 (a)\nA5.000\n", "G21 G0 X1. A2. (a)\nX2. A4.\nA4.5\nA5.\n", TWO);
    case("G21 G0 X2 A4.00 (a)\n", "G21 G0 X2.001 A4.00 (a)\n", BESIDE);
}

#[test]
fn what_cannot_be_written_is_refused() {
    let long = format!("G21 G0 X1 ({})\n", "x".repeat(238));
    for (program, pieces, code) in [
        (long.as_str(), UP, "gcode-line-too-long"),
        ("G0 A1\n", BESIDE, "gcode-no-units"),
        ("G21 G0 X1\n", (|_| (1, [f64::NAN; 6])) as Pieces, "gcode-division"),
        ("G21 G0 X1\n", |_| (1, [2e9, 0.0, 0.0, 0.0, 0.0, 0.0]), "gcode-division"),
    ] {
        match corrected(program, "XYZ", pieces) {
            Err(Error::Refusal(refusal)) => assert_eq!((refusal.code, refusal.line), (code, 1)),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn calls_in_the_wrong_order_are_refused() {
    let start =
        || Corrector::new(&b"G21 G0 X1\nX2\n"[..], Vec::new(), settings("XYZ"), Digits::default());
    let mut corrector = start();
    assert_eq!(corrector.read(1).unwrap().len(), 1);
    assert!(matches!(corrector.read(1), Err(Error::Call(_))));
    assert!(matches!(corrector.write(&[], &[], &[]), Err(Error::Call(_))));
    assert!(matches!(corrector.write(&[0], &[], &[]), Err(Error::Call(_))));
    assert!(matches!(corrector.write(&[2], &[[0.0; AXES]], &[1.0]), Err(Error::Call(_))));
    assert!(matches!(corrector.finish(), Err(Error::Call(_))));
    assert!(matches!(start().finish(), Err(Error::Call(_))));
    let mut corrector = start();
    let end = corrector.read(1).unwrap()[0].end;
    assert!(matches!(corrector.write(&[1], &[end], &[0.5]), Err(Error::Refusal(_))));
}

/// Gives out a few bytes at a time.
struct Trickle<'a>(&'a [u8]);

impl std::io::Read for Trickle<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.0.len().min(buffer.len()).min(7);
        buffer[..count].copy_from_slice(&self.0[..count]);
        self.0 = &self.0[count..];
        Ok(count)
    }
}

#[test]
fn lines_come_whole_however_the_file_is_read() {
    let mut program = String::from("G21 G1 F1 X0\n");
    for line in 0..20_000 {
        program += &format!("N{line} X{line} (a comment of some length)\n");
    }
    program += "M2\nwhat follows stays";
    let moves = |input: &mut dyn std::io::Read| {
        let mut reader = Reader::new(input, settings("XYZ"));
        std::iter::from_fn(|| reader.next_move().unwrap()).map(|m| m.end[0]).collect::<Vec<_>>()
    };
    let expected = moves(&mut program.as_bytes());
    assert_eq!(expected.len(), 20_001);
    assert_eq!(moves(&mut Trickle(program.as_bytes())), expected);
    assert_eq!(corrected(&program, "XYZ", SAME).unwrap(), program);
}

#[test]
fn lines_are_bounded() {
    for (length, newline, taken) in [
        (252, "\n", true),
        (253, "\n", false),
        (253, "", false),
        (1 << 20, "", false),
        (1 << 20, "\n", false),
    ] {
        let program = format!("G21 G0 X1 ({}){newline}", "x".repeat(length - 12));
        match Reader::new(program.as_bytes(), settings("XYZ")).next_move() {
            Ok(Some(_)) => assert!(taken, "{length}"),
            Err(Error::Refusal(refusal)) => {
                assert!(!taken, "{length}");
                assert_eq!((refusal.code, refusal.line), ("gcode-line-too-long", 1));
                assert_eq!(refusal.column, 253);
            }
            other => panic!("{other:?}"),
        }
    }
    // Behind the end nobody looks.
    let program = format!("G21 G0 X1\nM2\n{}", "x".repeat(1 << 20));
    assert_eq!(corrected(&program, "XYZ", SAME).unwrap(), program);
}

#[test]
fn what_acts_before_the_move_goes_in_front_of_the_pieces_with_its_words() {
    case(
        "G21 G0 X0\nG1 X10 F100 M3 S800 (a)\n/N7 X20 M66 P2 E1 L0 M8\nX30 T4 M6\nX40 M62 P1\nX50 M68 E2 Q5.5 M2\n",
        "G21 G0 X0\nM3 S800\nG1 X5. F100 (a)\nX10.\n/M66 P2 E1 L0 M8\n/N7 X15.\n/X20.\nT4 M6\nX25.\nX30.\n\
         X35. M62 P1\nX40.\nM68 E2 Q5.5\nX45.\nX50. M2\n",
        |motion| (if motion.line == 1 { 1 } else { 2 }, [0.0; 6]),
    );
    // One block stays one: where it acts is the program's own business.
    case("G21 G0 X1 M3 S5\n", "G21 G0 X1.001 M3 S5\n", BESIDE);
}

#[test]
fn an_offset_that_nobody_gave_is_refused() {
    let refused = |program: &str| match corrected(program, "XYZ", SAME) {
        Err(Error::Refusal(refusal)) => (refusal.code, refusal.line, refusal.found.unwrap()),
        other => panic!("{other:?}"),
    };
    assert_eq!(refused("G21 G0 X1\nG90 G56 X2\n"), ("gcode-no-offset", 2, "G56".to_owned()));
    assert_eq!(refused("G21 G54\n"), ("gcode-no-offset", 1, "G54".to_owned()));
    case("G21 G55 G0 X1\n", "G21 G55 G0 X1\n", SAME);
}

/// A quarter of a turn: what is written as X goes along the machine's Y.
#[test]
fn a_turned_coordinate_system_is_corrected_in_its_own_axes() {
    let mut settings = settings("XYZ");
    let mut origin = [0.0; AXES];
    origin[..2].copy_from_slice(&[100.0, 50.0]);
    settings.offsets[0] = Some(WorkOffset { origin, rotation: std::f64::consts::FRAC_PI_2 });
    let program = "G21 G0 X10 Y0\nG1 X20 F9\nG2 X20 Y-10 I0 J-5\n";
    let mut reader = Reader::new(program.as_bytes(), settings.clone());
    let mut ends = Vec::new();
    while let Some(motion) = reader.next_move().unwrap() {
        ends.push([motion.end[0], motion.end[1], motion.point(0.5)[0], motion.point(0.5)[1]]);
    }
    let expected = [[100.0, 60.0], [100.0, 70.0], [110.0, 70.0]];
    for (end, expected) in ends.iter().zip(expected) {
        assert!((end[0] - expected[0]).abs() < 1e-12 && (end[1] - expected[1]).abs() < 1e-12);
    }
    // Clockwise about program (20, -5), machine (105, 70): over program (25, -5), machine (105, 75).
    assert!((ends[2][2] - 105.0).abs() < 1e-12 && (ends[2][3] - 75.0).abs() < 1e-12);

    let mut corrector = Corrector::new(program.as_bytes(), Vec::new(), settings, Digits::default());
    let moves = corrector.read(9).unwrap().to_vec();
    let points: Vec<Position> = moves
        .iter()
        .map(|motion| {
            let mut point = motion.end;
            point[0] += 0.25; // machine X: against the program's Y
            point
        })
        .collect();
    corrector.write(&[1; 3], &points, &[1.0; 3]).unwrap();
    let written = String::from_utf8(corrector.finish().unwrap()).unwrap();
    assert_eq!(written, "G21 G0 X10. Y-0.25\nG1 X20 F9\nG1 X20. Y-10.25\n");
}

#[test]
fn a_heading_is_the_first_line_or_the_second_behind_a_percent() {
    for (program, expected) in [
        ("G21\nG0 X1\n", "(why)\nG21\nG0 X1\n"),
        ("%\r\nG21 G0 X1\r\n%\r\n", "%\r\n(why)\r\nG21 G0 X1\r\n%\r\n"),
        ("\nG21 G0 X1\n", "\n(why)\nG21 G0 X1\n"),
        ("G21 G0 X1\n", "(why)\nG21 G0 X1\n"),
    ] {
        let mut corrector =
            Corrector::new(program.as_bytes(), Vec::new(), settings("XYZ"), Digits::default())
                .with_heading("why");
        let points: Vec<Position> =
            corrector.read(9).unwrap().iter().map(|motion| motion.end).collect();
        corrector.write(&[1], &points, &[1.0]).unwrap();
        assert_eq!(String::from_utf8(corrector.finish().unwrap()).unwrap(), expected);
    }
}

#[test]
fn blended_pieces_end_in_the_exact_stop_that_their_block_asks_for() {
    let blended = |program: &str, pieces: Pieces| {
        let corrector =
            Corrector::new(program.as_bytes(), Vec::new(), settings("XYZ"), Digits::default());
        written(corrector.with_path_mode("G64 P0.002"), pieces).unwrap()
    };
    assert_eq!(
        blended("G21 G61.1\r\nG1 X10 F100\r\nG61 X20\r\nG64 X30\r\n", TWO),
        "G21 G61.1\r\nG64 P0.002\r\nG1 X5. F100\r\nG61.1\r\nX10.\r\n\
         G64 P0.002\r\n X15.\r\nG61\r\nX20.\r\nG64 X25.\r\nX30.\r\n"
    );
    // A code before the move comes first; lines of a block that may be left out are left out with it.
    let program = "G21 G61\nG1 X10 F1 M8 M0\n";
    assert_eq!(blended(program, TWO), "G21 G61\nM8\nG64 P0.002\nG1 X5. F1\nG61\nX10. M0\n");
    assert_eq!(
        blended("G21 G61\n/G1 X10 F1\n", TWO),
        "G21 G61\n/G64 P0.002\n/G1 X5. F1\n/G61\n/X10.\n"
    );
    // What is not divided stays as it is, and so does all of it where nobody asks.
    assert_eq!(blended("G21 G61 G0 X10\n", SAME), "G21 G61 G0 X10\n");
    case("G21 G61 G1 X10 F1\n", "G21 G61 G1 X5. F1\nX10.\n", TWO);
}

#[test]
fn moves_tell_their_speed_and_whether_the_tool_stops_behind_them() {
    let program = "G21 G94 G0 X10\nG61 G1 X20 F600\nG20 X1\nG61.1 G93 X2 F30\nG64 G94 A90 F60\n\
                   G95 X3 F1\nG94 F10 G21 X4\n";
    let mut reader = Reader::new(program.as_bytes(), settings("XYZ"));
    let mut told = Vec::new();
    while let Some(motion) = reader.next_move().unwrap() {
        told.push((motion.speed, motion.path_mode));
    }
    let expected = [
        (f64::INFINITY, None),
        (10.0, Some(PathMode::ExactPath)),
        // F was given in mm.
        (10.0, Some(PathMode::ExactPath)),
        // The inch takes a thirtieth of a minute.
        (25.4 / 2.0, Some(PathMode::ExactStop)),
        // Degrees.
        (1.0, Some(PathMode::Blending)),
        (f64::NAN, Some(PathMode::Blending)),
        // F is read before G21 of its block.
        (254.0 / 60.0, Some(PathMode::Blending)),
    ];
    assert_eq!(told.len(), expected.len());
    for ((speed, mode), (expected_speed, expected_mode)) in told.into_iter().zip(expected) {
        let same = speed == expected_speed || (speed.is_nan() && expected_speed.is_nan());
        assert!(same || (speed - expected_speed).abs() < 1e-12, "{speed} for {expected_speed}");
        assert_eq!(mode, expected_mode);
    }
}
