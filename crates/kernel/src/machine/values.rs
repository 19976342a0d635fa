//! A machine's description as plain values, whatever language or format it came from.

use std::collections::BTreeMap;

/// Values by their keys.
pub type Table = BTreeMap<String, Value>;

/// What stands in a [`Table`].
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// As if its key were not there.
    Nothing,
    /// True or false.
    Flag(bool),
    /// A number.
    Number(f64),
    /// A word.
    Text(String),
    /// Values in an order.
    List(Vec<Value>),
    /// A table in the table.
    Table(Table),
    /// What no description has a use for, by the name of its type.
    Other(String),
}

impl Value {
    /// What it is, in a message.
    pub fn kind(&self) -> &str {
        match self {
            Value::Nothing => "nothing",
            Value::Flag(_) => "a flag",
            Value::Number(_) => "a number",
            Value::Text(_) => "a text",
            Value::List(_) => "a list",
            Value::Table(_) => "a table",
            Value::Other(name) => name,
        }
    }
}

/// What is read from values.
pub(super) trait FromValue<'a>: Sized {
    /// What it is called in a message.
    fn name() -> String;
    /// None where the value is something else.
    fn from_value(value: &'a Value) -> Option<Self>;
}

impl FromValue<'_> for f64 {
    fn name() -> String {
        "a number".to_owned()
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Number(number) => Some(*number),
            _ => None,
        }
    }
}

impl FromValue<'_> for bool {
    fn name() -> String {
        "true or false".to_owned()
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Flag(flag) => Some(*flag),
            _ => None,
        }
    }
}

impl FromValue<'_> for String {
    fn name() -> String {
        "a text".to_owned()
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Text(text) => Some(text.clone()),
            _ => None,
        }
    }
}

impl<'a> FromValue<'a> for &'a Table {
    fn name() -> String {
        "a table".to_owned()
    }

    fn from_value(value: &'a Value) -> Option<Self> {
        match value {
            Value::Table(table) => Some(table),
            _ => None,
        }
    }
}

impl<'a, T: FromValue<'a>> FromValue<'a> for Vec<T> {
    fn name() -> String {
        format!("a list, each {}", T::name())
    }

    fn from_value(value: &'a Value) -> Option<Self> {
        match value {
            Value::List(list) => list.iter().map(T::from_value).collect(),
            _ => None,
        }
    }
}

impl<'a, T: FromValue<'a>, const N: usize> FromValue<'a> for [T; N] {
    fn name() -> String {
        format!("a list of {N}, each {}", T::name())
    }

    fn from_value(value: &'a Value) -> Option<Self> {
        Vec::<T>::from_value(value)?.try_into().ok()
    }
}

impl<'a, T: FromValue<'a>> FromValue<'a> for BTreeMap<String, T> {
    fn name() -> String {
        format!("a table, each {}", T::name())
    }

    fn from_value(value: &'a Value) -> Option<Self> {
        let Value::Table(table) = value else { return None };
        table.iter().map(|(key, value)| Some((key.clone(), T::from_value(value)?))).collect()
    }
}
