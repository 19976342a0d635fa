//! Programs of machine tools: their moves as arrays, and programs rewritten.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::path::PathBuf;

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::create_exception;
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use truepose_gcode::{
    AXES, AXIS_LETTERS, AxisSet, Corrector, Digits, Error, Move, PathMode, Position, Reader,
    Refusal, Settings, Units, WorkOffset,
};

use crate::arrays::{self, Array};

create_exception!(
    truepose._kernel,
    GcodeError,
    PyValueError,
    "A program cannot be interpreted exactly. Attributes: code, message, line, column, found, expected, hint."
);

/// The codes that a `GcodeError` can have, each with its meaning in one line.
#[pyfunction]
pub fn gcode_codes() -> HashMap<&'static str, &'static str> {
    Refusal::CODES.iter().copied().collect()
}

fn python_error(py: Python<'_>, error: Error) -> PyErr {
    match error {
        Error::Io(error) => error.into(),
        Error::Call(message) => PyRuntimeError::new_err(message),
        Error::Refusal(refusal) => {
            let error = GcodeError::new_err(refusal.to_string());
            let value = error.value(py);
            let Refusal { code, message, line, column, found, expected, hint } = *refusal;
            let set = || -> PyResult<()> {
                value.setattr("code", code)?;
                value.setattr("message", message)?;
                value.setattr("line", line)?;
                value.setattr("column", column)?;
                value.setattr("found", found)?;
                value.setattr("expected", expected)?;
                value.setattr("hint", hint)
            };
            set().err().unwrap_or(error)
        }
    }
}

fn axis_of(letter: &str) -> PyResult<usize> {
    let axis = match letter.as_bytes() {
        [letter] => AXIS_LETTERS.iter().position(|axis| *axis == letter.to_ascii_uppercase()),
        _ => None,
    };
    axis.ok_or_else(|| {
        PyValueError::new_err(format!("{letter:?} is no axis; X Y Z A B C U V W are"))
    })
}

/// Coordinates by the axes' letters; `missing` where an axis is not named.
fn position(named: &HashMap<String, f64>, missing: f64) -> PyResult<Position> {
    let mut position = [missing; AXES];
    for (letter, coordinate) in named {
        if !coordinate.is_finite() {
            return Err(PyValueError::new_err(format!("{letter}: {coordinate} is not finite")));
        }
        position[axis_of(letter)?] = *coordinate;
    }
    Ok(position)
}

const SYSTEMS: [&str; 9] = ["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"];

type Named = HashMap<String, f64>;

fn settings(
    units: Option<&str>,
    start: Option<Named>,
    offsets: Option<HashMap<String, Named>>,
    active: &str,
    reference: Option<HashMap<String, Named>>,
    block_delete: Option<bool>,
    axes: &str,
) -> PyResult<Settings> {
    let refuse = |message: String| Err(PyValueError::new_err(message));
    let units = match units {
        None => None,
        Some("mm") => Some(Units::Millimetre),
        Some("inch") => Some(Units::Inch),
        Some(other) => return refuse(format!("units: {other:?} is neither mm nor inch")),
    };
    let Some(axes) = AxisSet::from_letters(axes) else {
        return refuse(format!("axes: {axes:?} is no set of the letters X Y Z A B C U V W"));
    };
    let mut settings = Settings { units, block_delete, axes, ..Settings::default() };
    if let Some(start) = start {
        settings.start = position(&start, f64::NAN)?;
    }
    let system = |name: &str| match SYSTEMS.iter().position(|system| *system == name) {
        Some(system) => Ok(system),
        None => Err(PyValueError::new_err(format!(
            "offsets: {name:?} is none of {}",
            SYSTEMS.join(" ")
        ))),
    };
    for (name, mut offset) in offsets.unwrap_or_default() {
        let rotation = offset.remove("R").unwrap_or(0.0).to_radians();
        if !rotation.is_finite() {
            return refuse(format!("offsets: the rotation of {name} is not finite"));
        }
        let origin = position(&offset, 0.0)?;
        settings.offsets[system(&name)?] = Some(WorkOffset { origin, rotation });
    }
    settings.system = system(active)?;
    for (name, place) in reference.unwrap_or_default() {
        let which = match name.as_str() {
            "G28" => 0,
            "G30" => 1,
            _ => return refuse(format!("reference: {name:?} is neither G28 nor G30")),
        };
        settings.reference[which] = position(&place, f64::NAN)?;
    }
    Ok(settings)
}

/// Some moves of a program, in its order.
#[pyclass(frozen, module = "truepose._kernel")]
pub struct GcodeMoves {
    moves: Vec<Move>,
}

/// An array (count, W) whose rows are filled one after the other.
fn rows<'py, const W: usize>(
    py: Python<'py>,
    count: usize,
    values: impl IntoIterator<Item = [f64; W]>,
) -> PyResult<Array<'py>> {
    let array = arrays::output(py, &[count], &[W])?;
    for (row, value) in array.readwrite().as_slice_mut()?.chunks_exact_mut(W).zip(values) {
        row.copy_from_slice(&value);
    }
    Ok(array)
}

#[pymethods]
impl GcodeMoves {
    fn __len__(&self) -> usize {
        self.moves.len()
    }

    #[getter]
    fn line<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.moves.iter().map(|motion| motion.line as i64))
    }

    #[getter]
    fn kind<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u8>> {
        PyArray1::from_iter(py, self.moves.iter().map(|motion| motion.kind as u8))
    }

    #[getter]
    fn start<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        rows(py, self.moves.len(), self.moves.iter().map(|motion| motion.start))
    }

    #[getter]
    fn end<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        rows(py, self.moves.len(), self.moves.iter().map(|motion| motion.end))
    }

    #[getter]
    fn length<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.moves.iter().map(Move::length))
    }

    #[getter]
    fn speed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.moves.iter().map(|motion| motion.speed))
    }

    #[getter]
    fn stops<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        let stops = |motion: &Move| motion.path_mode.is_some_and(PathMode::stops);
        PyArray1::from_iter(py, self.moves.iter().map(stops))
    }

    #[getter]
    fn plane<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u8>> {
        let plane = |motion: &Move| match motion.arc.map(|arc| arc.plane[0]) {
            None => 0,
            Some(0) => 17,
            Some(2) => 18,
            Some(_) => 19,
        };
        PyArray1::from_iter(py, self.moves.iter().map(plane))
    }

    #[getter]
    fn centre<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let centre = |motion: &Move| motion.arc.map_or([f64::NAN; 2], |arc| arc.centre);
        rows(py, self.moves.len(), self.moves.iter().map(centre))
    }

    #[getter]
    fn sweep<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let sweep = |motion: &Move| motion.arc.map_or(0.0, |arc| arc.sweep);
        PyArray1::from_iter(py, self.moves.iter().map(sweep))
    }

    #[getter]
    fn turns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i32>> {
        let turns = |motion: &Move| motion.arc.map_or(0, |arc| arc.turns);
        PyArray1::from_iter(py, self.moves.iter().map(turns))
    }

    fn points<'py>(
        &self,
        py: Python<'py>,
        index: PyReadonlyArray1<'py, i64>,
        share: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Array<'py>> {
        let (index, share) = (index.as_array(), share.as_array());
        if index.len() != share.len() {
            return Err(PyValueError::new_err("index and share are not equally long"));
        }
        let point = |(index, share): (&i64, &f64)| {
            let motion = usize::try_from(*index).ok().and_then(|index| self.moves.get(index));
            motion.map(|motion| motion.point(*share)).ok_or_else(|| {
                let message = format!("there is no move {index} among {}", self.moves.len());
                PyIndexError::new_err(message)
            })
        };
        let points: Vec<Position> =
            index.iter().zip(share.iter()).map(point).collect::<PyResult<_>>()?;
        rows(py, points.len(), points)
    }
}

/// Reads the moves of a program.
#[pyclass(module = "truepose._kernel")]
pub struct GcodeReader {
    reader: Reader<File>,
}

#[pymethods]
impl GcodeReader {
    #[new]
    #[pyo3(signature = (path, *, units=None, start=None, offsets=None, system="G54", reference=None, block_delete=None, axes="XYZ"))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of a Python constructor")]
    fn new(
        path: PathBuf,
        units: Option<&str>,
        start: Option<Named>,
        offsets: Option<HashMap<String, Named>>,
        system: &str,
        reference: Option<HashMap<String, Named>>,
        block_delete: Option<bool>,
        axes: &str,
    ) -> PyResult<Self> {
        let settings = settings(units, start, offsets, system, reference, block_delete, axes)?;
        Ok(GcodeReader { reader: Reader::new(File::open(path)?, settings) })
    }

    fn read(&mut self, py: Python<'_>, most_moves: usize) -> PyResult<GcodeMoves> {
        let reader = &mut self.reader;
        let result = py.detach(|| {
            let mut moves = Vec::new();
            while moves.len() < most_moves.max(1) {
                match reader.next_move()? {
                    Some(motion) => moves.push(motion),
                    None => break,
                }
            }
            Ok(GcodeMoves { moves })
        });
        result.map_err(|error| python_error(py, error))
    }

    #[getter]
    fn lines(&self) -> u64 {
        self.reader.line()
    }
}

/// Rewrites a program with corrected moves.
#[pyclass(module = "truepose._kernel")]
pub struct GcodeCorrector {
    corrector: Option<Corrector<File, File>>,
}

impl GcodeCorrector {
    fn open(&mut self) -> PyResult<&mut Corrector<File, File>> {
        self.corrector.as_mut().ok_or_else(|| PyRuntimeError::new_err("the program is finished"))
    }
}

#[pymethods]
impl GcodeCorrector {
    #[new]
    #[pyo3(signature = (path, target, *, units=None, start=None, offsets=None, system="G54", reference=None, block_delete=None, axes="XYZ", digits=6, heading=None, path_mode=None))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of a Python constructor")]
    fn new(
        path: PathBuf,
        target: PathBuf,
        units: Option<&str>,
        start: Option<Named>,
        offsets: Option<HashMap<String, Named>>,
        system: &str,
        reference: Option<HashMap<String, Named>>,
        block_delete: Option<bool>,
        axes: &str,
        digits: u32,
        heading: Option<&str>,
        path_mode: Option<&str>,
    ) -> PyResult<Self> {
        let settings = settings(units, start, offsets, system, reference, block_delete, axes)?;
        if digits > 8 {
            return Err(PyValueError::new_err(format!("digits: {digits} is not from 0 to 8")));
        }
        let digits = Digits { millimetre: digits, inch: digits + 1, degree: digits };
        let input = File::open(path)?;
        // Opened and emptied only once the program itself could be opened.
        let output = OpenOptions::new().write(true).create(true).truncate(true).open(target)?;
        let mut corrector = Corrector::new(input, output, settings, digits);
        if let Some(text) = heading {
            corrector = corrector.with_heading(text);
        }
        if let Some(block) = path_mode {
            corrector = corrector.with_path_mode(block);
        }
        Ok(GcodeCorrector { corrector: Some(corrector) })
    }

    fn read(&mut self, py: Python<'_>, most_moves: usize) -> PyResult<GcodeMoves> {
        let corrector = self.open()?;
        let result = py.detach(|| corrector.read(most_moves).map(<[Move]>::to_vec));
        match result {
            Ok(moves) => Ok(GcodeMoves { moves }),
            Err(error) => Err(python_error(py, error)),
        }
    }

    fn write<'py>(
        &mut self,
        py: Python<'py>,
        counts: PyReadonlyArray1<'py, i64>,
        points: PyReadonlyArray2<'py, f64>,
        shares: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<()> {
        if points.shape()[1] != AXES {
            let columns = points.shape()[1];
            let message =
                format!("points: columns {columns} columns, expected one for each of {AXES} axes");
            return Err(PyValueError::new_err(message));
        }
        let counts = counts.as_array().iter().map(|count| usize::try_from(*count)).collect();
        let counts: Vec<usize> = match counts {
            Ok(counts) => counts,
            Err(_) => return Err(PyValueError::new_err("counts: a count is negative")),
        };
        let points: Vec<Position> = points
            .as_array()
            .rows()
            .into_iter()
            .map(|row| std::array::from_fn(|i| row[i]))
            .collect();
        let shares = shares.as_array().to_vec();
        let corrector = self.open()?;
        py.detach(|| corrector.write(&counts, &points, &shares))
            .map_err(|error| python_error(py, error))
    }

    fn finish(&mut self, py: Python<'_>) -> PyResult<()> {
        self.open()?;
        let Some(corrector) = self.corrector.take() else { return Ok(()) };
        py.detach(|| corrector.finish().map(drop)).map_err(|error| python_error(py, error))
    }

    #[getter]
    fn lines(&mut self) -> PyResult<u64> {
        Ok(self.open()?.line())
    }
}

/// Adds the classes and functions of programs to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("GcodeError", module.py().get_type::<GcodeError>())?;
    module.add("GCODE_AXES", String::from_utf8_lossy(&AXIS_LETTERS))?;
    module.add_class::<GcodeMoves>()?;
    module.add_class::<GcodeReader>()?;
    module.add_class::<GcodeCorrector>()?;
    module.add_function(wrap_pyfunction!(gcode_codes, module)?)?;
    Ok(())
}
