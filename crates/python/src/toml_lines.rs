//! Where each key of a TOML document stands: the standard library's parser does not tell.

use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use std::ops::Range;
use toml_edit::{Document, Item, TableLike, Value};

/// One step of a path: a key, or the index in an array.
#[derive(Clone)]
enum Step {
    Key(String),
    Index(usize),
}

struct Finder {
    /// Where each line ends.
    ends: Vec<usize>,
    lines: Vec<(Vec<Step>, usize)>,
}

impl Finder {
    fn note(&mut self, path: &[Step], span: Option<Range<usize>>) {
        if let Some(span) = span {
            let line = 1 + self.ends.partition_point(|&end| end < span.start);
            self.lines.push((path.to_vec(), line));
        }
    }

    fn table(&mut self, path: &mut Vec<Step>, table: &dyn TableLike) {
        for (name, item) in table.iter() {
            path.push(Step::Key(name.to_owned()));
            let own = table.get_key_value(name).and_then(|(key, _)| key.span());
            let headed = matches!(item, Item::Table(_) | Item::ArrayOfTables(_));
            let span = if headed { item.span().or(own) } else { own.or_else(|| item.span()) };
            self.note(path, span);
            self.item(path, item);
            path.pop();
        }
    }

    fn item(&mut self, path: &mut Vec<Step>, item: &Item) {
        match item {
            Item::Table(table) => self.table(path, table),
            Item::ArrayOfTables(tables) => {
                for (index, table) in tables.iter().enumerate() {
                    path.push(Step::Index(index));
                    self.note(path, table.span());
                    self.table(path, table);
                    path.pop();
                }
            }
            Item::Value(value) => self.value(path, value),
            Item::None => {}
        }
    }

    fn value(&mut self, path: &mut Vec<Step>, value: &Value) {
        match value {
            Value::InlineTable(table) => self.table(path, table),
            Value::Array(array) => {
                for (index, item) in array.iter().enumerate() {
                    path.push(Step::Index(index));
                    self.note(path, item.span());
                    self.value(path, item);
                    path.pop();
                }
            }
            _ => {}
        }
    }
}

/// The line (from 1) of every key and array item: a list of (path, line).
#[pyfunction]
pub fn toml_lines<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyList>> {
    let document =
        Document::parse(text).map_err(|error| PyValueError::new_err(error.to_string()))?;
    let ends = text.match_indices('\n').map(|(end, _)| end).collect();
    let mut finder = Finder { ends, lines: Vec::new() };
    finder.table(&mut Vec::new(), document.as_table());
    let list = PyList::empty(py);
    for (path, line) in finder.lines {
        let steps: Vec<Bound<'py, PyAny>> = path
            .into_iter()
            .map(|step| match step {
                Step::Key(key) => key.into_bound_py_any(py),
                Step::Index(index) => index.into_bound_py_any(py),
            })
            .collect::<PyResult<_>>()?;
        list.append((PyTuple::new(py, steps)?, line))?;
    }
    Ok(list)
}
