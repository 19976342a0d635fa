//! Values of a request, read with checks and with the place where they stand.

use crate::reply::{Answer, fault};
use serde_json::Value;

/// The code of a request that is none.
pub const BAD_REQUEST: &str = "bad-request";

/// A value, and where it stands.
#[derive(Clone, Debug)]
pub struct Given<'a> {
    /// The value.
    pub value: &'a Value,
    /// As `bundle.columns[3]`.
    pub place: String,
}

impl<'a> Given<'a> {
    /// A whole request or bundle.
    pub fn root(value: &'a Value, name: &str) -> Self {
        Given { value, place: name.to_owned() }
    }

    /// A fault of this value.
    pub fn refuse<T>(&self, message: impl Into<String>) -> Answer<T> {
        fault(BAD_REQUEST, self.place.clone(), message)
    }

    /// The value of a key; None where it is missing or null.
    pub fn get(&self, key: &str) -> Option<Given<'a>> {
        let value = self.value.get(key).filter(|value| !value.is_null())?;
        Some(Given { value, place: format!("{}.{key}", self.place) })
    }

    /// The value of a key that has to be there.
    pub fn item(&self, key: &str) -> Answer<Given<'a>> {
        match self.get(key) {
            Some(item) => Ok(item),
            None => self.refuse(format!("it has no {key:?}")),
        }
    }

    /// A finite number.
    pub fn number(&self) -> Answer<f64> {
        match self.value.as_f64() {
            Some(number) if number.is_finite() => Ok(number),
            _ => self.refuse("expected a finite number"),
        }
    }

    /// A number below a limit that counts something.
    pub fn below(&self, limit: usize, what: &str) -> Answer<usize> {
        match self.value.as_u64().and_then(|number| usize::try_from(number).ok()) {
            Some(number) if number < limit => Ok(number),
            _ => self.refuse(format!("there is no such {what}: there are {limit}")),
        }
    }

    /// A whole number from 0.
    pub fn whole(&self) -> Answer<u64> {
        match self.value.as_u64() {
            Some(number) => Ok(number),
            None => self.refuse("expected a whole number, 0 or more"),
        }
    }

    /// A text.
    pub fn text(&self) -> Answer<&'a str> {
        match self.value.as_str() {
            Some(text) => Ok(text),
            None => self.refuse("expected a text"),
        }
    }

    /// True or false.
    pub fn flag(&self) -> Answer<bool> {
        match self.value.as_bool() {
            Some(flag) => Ok(flag),
            None => self.refuse("expected true or false"),
        }
    }

    /// A flag that is false where it is missing.
    pub fn is_asked(&self, key: &str) -> Answer<bool> {
        self.get(key).map_or(Ok(false), |flag| flag.flag())
    }

    /// The values of a list.
    pub fn list(&self) -> Answer<Vec<Given<'a>>> {
        let Some(list) = self.value.as_array() else { return self.refuse("expected a list") };
        let one = |(at, value)| Given { value, place: format!("{}[{at}]", self.place) };
        Ok(list.iter().enumerate().map(one).collect())
    }

    /// The values of a list under a key; none where the key is missing.
    pub fn list_of(&self, key: &str) -> Answer<Vec<Given<'a>>> {
        self.get(key).map_or(Ok(Vec::new()), |list| list.list())
    }

    /// Keys and values of a table.
    pub fn entries(&self) -> Answer<Vec<(&'a str, Given<'a>)>> {
        let Some(table) = self.value.as_object() else { return self.refuse("expected a table") };
        let one = |(key, value): (&'a String, &'a Value)| {
            (key.as_str(), Given { value, place: format!("{}.{key}", self.place) })
        };
        Ok(table.iter().map(one).collect())
    }

    /// Keys and values of a table under a key; none where the key is missing.
    pub fn entries_of(&self, key: &str) -> Answer<Vec<(&'a str, Given<'a>)>> {
        self.get(key).map_or(Ok(Vec::new()), |table| table.entries())
    }

    /// Finite numbers.
    pub fn numbers(&self) -> Answer<Vec<f64>> {
        let Some(list) = self.value.as_array() else { return self.refuse("expected numbers") };
        let mut numbers = Vec::with_capacity(list.len());
        for (at, value) in list.iter().enumerate() {
            match value.as_f64() {
                Some(number) if number.is_finite() => numbers.push(number),
                _ => return self.refuse(format!("number {at} is no finite number")),
            }
        }
        Ok(numbers)
    }

    /// So many finite numbers.
    pub fn fixed<const N: usize>(&self) -> Answer<[f64; N]> {
        match self.numbers()?.try_into() {
            Ok(numbers) => Ok(numbers),
            Err(_) => self.refuse(format!("expected {N} numbers")),
        }
    }

    /// Rows of so many finite numbers, one after another; and how many rows.
    pub fn rows(&self, width: usize) -> Answer<(Vec<f64>, usize)> {
        let Some(list) = self.value.as_array() else { return self.refuse("expected rows") };
        let mut numbers = Vec::with_capacity(list.len() * width);
        for (at, row) in list.iter().enumerate() {
            let row = Given { value: row, place: String::new() };
            match row.numbers() {
                Ok(row) if row.len() == width => numbers.extend(row),
                _ => return self.refuse(format!("row {at} is not of {width} finite numbers")),
            }
        }
        Ok((numbers, list.len()))
    }

    /// Numbers below a limit, that count something.
    pub fn all_below(&self, limit: usize, what: &str) -> Answer<Vec<usize>> {
        self.list()?.iter().map(|number| number.below(limit, what)).collect()
    }
}
