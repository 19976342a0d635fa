//! What must hold for any bytes: no panic, no growth, and a program written anew unchanged makes the
//! same moves. Shared by the tests and the fuzz target.

use truepose_gcode::{
    AXES, AxisSet, Corrector, Digits, Error, Kind, Move, Position, Reader, Settings, UNKNOWN,
    Units, WorkOffset,
};

/// Settings out of one byte, and into how many pieces moves are divided.
fn settings_of(byte: u8) -> (Settings, usize) {
    let mut settings = Settings::default();
    let origin = [10.0, -20.5, 3.25, 45.0, 0.0, -90.0, 1.0, 2.0, 3.0];
    settings.offsets = [Some(WorkOffset::NONE); 9];
    settings.offsets[1] = Some(WorkOffset { origin, rotation: 0.0 });
    settings.offsets[2] = Some(WorkOffset { origin, rotation: 0.5 });
    if byte & 1 == 0 {
        settings.start = [0.0; AXES];
    } else {
        settings.start = UNKNOWN;
        settings.reference = [[1.0; AXES], UNKNOWN];
    }
    if byte & 2 == 0 {
        settings.units = Some(if byte & 4 == 0 { Units::Millimetre } else { Units::Inch });
    }
    settings.block_delete =
        [None, Some(false), Some(true), Some(false)][usize::from(byte >> 3 & 3)];
    let axes = ["XYZ", "XYZABC", "XY", "XYZABCUVW"][usize::from(byte >> 5 & 3)];
    settings.axes = AxisSet::from_letters(axes).unwrap();
    (settings, if byte & 128 == 0 { 1 } else { 3 })
}

/// Moves up to the end or to what is refused.
fn read(program: &[u8], settings: &Settings) -> (Vec<Move>, Option<String>) {
    let mut reader = Reader::new(program, settings.clone());
    let mut moves = Vec::new();
    loop {
        match reader.next_move() {
            Ok(Some(motion)) => moves.push(motion),
            Ok(None) => return (moves, None),
            Err(Error::Refusal(refusal)) => {
                assert!(refusal.line >= 1 && refusal.column >= 1, "{refusal}");
                return (moves, Some(refusal.to_string()));
            }
            Err(error) => panic!("{error}"),
        }
    }
}

/// Whether a written move ends where it should; what is not known on the way may be anywhere.
fn close(end: &Position, expected: &Position) -> bool {
    end.iter()
        .zip(expected)
        .all(|(a, b)| b.is_nan() || (a - b).abs() <= 3e-6 + 1e-14 * a.abs().max(b.abs()))
}

/// The program written anew with its own points, and these points; `None` where it cannot be.
pub fn write(
    program: &[u8],
    settings: &Settings,
    pieces: usize,
) -> Result<(Vec<u8>, Vec<Position>), Error> {
    let mut corrector = Corrector::new(program, Vec::new(), settings.clone(), Digits::default());
    let mut ends = Vec::new();
    loop {
        let moves = corrector.read(7)?.to_vec();
        if moves.is_empty() {
            return Ok((corrector.finish()?, ends));
        }
        let (mut counts, mut points, mut shares) = (Vec::new(), Vec::new(), Vec::new());
        for motion in &moves {
            let known = motion.start.iter().all(|x| !x.is_nan()) || motion.kind == Kind::Arc;
            let count = match motion.kind {
                Kind::Arc => pieces.max(2),
                _ if known => pieces,
                _ => 1,
            };
            counts.push(count);
            for piece in 1..=count {
                let share = if piece == count { 1.0 } else { piece as f64 / count as f64 };
                points.push(motion.point(share));
                shares.push(share);
            }
        }
        corrector.write(&counts, &points, &shares)?;
        ends.extend_from_slice(&points);
    }
}

/// Checks all of it for some bytes; the last one chooses the settings.
pub fn check(data: &[u8]) {
    let Some((byte, program)) = data.split_last() else { return };
    let (settings, pieces) = settings_of(*byte);
    let (moves, refusal) = read(program, &settings);
    for motion in &moves {
        for coordinate in motion.point(0.37).iter().chain(&motion.point(1.0)) {
            assert!(!coordinate.is_infinite());
        }
        assert!(motion.length().is_finite() && motion.length() >= 0.0);
    }
    let (written, ends) = match write(program, &settings, pieces) {
        Ok(written) => written,
        Err(Error::Refusal(problem)) => {
            let written_only =
                ["gcode-line-too-long", "gcode-division", "gcode-no-units", "gcode-number-range"];
            assert!(
                refusal.is_some() || written_only.contains(&problem.code),
                "read, but not written: {problem}"
            );
            return;
        }
        Err(error) => panic!("{error}"),
    };
    assert_eq!(refusal, None, "written, but not read");
    let (again, problem) = read(&written, &settings);
    let shown = || String::from_utf8_lossy(&written).into_owned();
    assert_eq!(problem, None, "{}", shown());
    let mut following = again.iter();
    for end in &ends {
        assert!(
            following.any(|motion| close(&motion.end, end)),
            "{end:?} is lost in:\n{}",
            shown()
        );
    }
    if pieces == 1 && moves.iter().all(|motion| motion.kind != Kind::Arc) {
        assert_eq!(written, program, "nothing was to change");
    }
}
