//! Values of a glTF's JSON, with the pointer (RFC 6901) that messages name them by.

use serde_json::Value;

use crate::error::{Error, InputError, Place, Result};

/// A fault at a pointer; the name of the file is put to it later.
pub(super) fn fault(pointer: &str, what: impl std::fmt::Display) -> Error {
    InputError::new("", Place::Whole, format!("{pointer}: {what}")).into()
}

/// A value and where it stands.
#[derive(Clone, Debug)]
pub(super) struct At<'a> {
    pub value: &'a Value,
    pub pointer: String,
}

impl<'a> At<'a> {
    /// The whole of a document.
    pub(super) fn root(value: &'a Value) -> Self {
        Self { value, pointer: String::new() }
    }

    /// A fault of this value.
    pub(super) fn fault(&self, what: impl std::fmt::Display) -> Error {
        fault(&self.pointer, what)
    }

    /// What an object has under a key, if it is there.
    pub(super) fn key(&self, key: &str) -> Option<Self> {
        let value = self.value.get(key)?;
        // Keys that are looked for have nothing to escape, but names of attributes may.
        let key = key.replace('~', "~0").replace('/', "~1");
        Some(Self { value, pointer: format!("{}/{key}", self.pointer) })
    }

    /// As [`At::key`], of what must be there.
    pub(super) fn needed(&self, key: &str) -> Result<Self> {
        self.key(key).ok_or_else(|| self.fault(format!("`{key}` is missing")))
    }

    /// The items of a list; none where it is not there.
    pub(super) fn list(&self, key: &str) -> Result<Vec<Self>> {
        let Some(list) = self.key(key) else { return Ok(Vec::new()) };
        let items = list.value.as_array().ok_or_else(|| list.fault("not a list"))?;
        let at = |(k, value)| Self { value, pointer: format!("{}/{k}", list.pointer) };
        Ok(items.iter().enumerate().map(at).collect())
    }

    /// The members of an object; none where it is not there.
    pub(super) fn object(&self, key: &str) -> Result<Vec<(&'a str, Self)>> {
        self.key(key).map_or(Ok(Vec::new()), |object| object.members())
    }

    /// The members of this value.
    pub(super) fn members(&self) -> Result<Vec<(&'a str, Self)>> {
        let members = self.value.as_object().ok_or_else(|| self.fault("not an object"))?;
        Ok(members.keys().filter_map(|key| Some((key.as_str(), self.key(key)?))).collect())
    }

    /// An item of one of the lists at the root, by its number.
    pub(super) fn item(&self, list: &str, number: usize) -> Option<Self> {
        let value = self.value.get(list)?.get(number)?;
        Some(Self { value, pointer: format!("{}/{list}/{number}", self.pointer) })
    }

    /// This value as a whole number.
    pub(super) fn number(&self) -> Result<usize> {
        // Some writers have 3.0 for 3.
        let whole = |x: f64| ((0.0..=MOST_WHOLE).contains(&x) && x.fract() == 0.0).then_some(x as u64);
        let number = self.value.as_u64().or_else(|| self.value.as_f64().and_then(whole));
        let number = number.ok_or_else(|| self.fault("not a whole number, 0 or more"))?;
        usize::try_from(number).map_err(|_| self.fault("too large"))
    }

    /// A whole number under a key, if it is there.
    pub(super) fn count(&self, key: &str) -> Result<Option<usize>> {
        self.key(key).map(|at| at.number()).transpose()
    }

    /// So many numbers under a key, if they are there.
    pub(super) fn numbers<const N: usize>(&self, key: &str) -> Result<Option<[f64; N]>> {
        let Some(at) = self.key(key) else { return Ok(None) };
        let list: Option<Vec<f64>> =
            at.value.as_array().and_then(|list| list.iter().map(Value::as_f64).collect());
        let numbers = list.and_then(|list| <[f64; N]>::try_from(list).ok());
        numbers.map(Some).ok_or_else(|| at.fault(format!("not a list of {N} numbers")))
    }

    /// Text under a key, if it is there.
    pub(super) fn text(&self, key: &str) -> Result<Option<&'a str>> {
        let Some(at) = self.key(key) else { return Ok(None) };
        at.value.as_str().map(Some).ok_or_else(|| at.fault("not text"))
    }

    /// An extension by its name, if it is there.
    pub(super) fn extension(&self, name: &str) -> Option<Self> {
        self.key("extensions")?.key(name)
    }
}

/// Up to here every whole number is a binary64 number.
const MOST_WHOLE: f64 = 9_007_199_254_740_992.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_and_their_pointers() {
        let value: Value =
            serde_json::from_str(r#"{"a": [{"b/c": 3, "d": [1, 2.5], "e": -1, "f": 4.0}]}"#).unwrap();
        let root = At::root(&value);
        let first = root.item("a", 0).unwrap();
        assert_eq!((first.count("b/c").unwrap(), first.count("f").unwrap()), (Some(3), Some(4)));
        assert_eq!(first.count("none").unwrap(), None);
        assert_eq!(first.numbers::<2>("d").unwrap(), Some([1.0, 2.5]));
        let says = |error: Error| error.to_string();
        assert_eq!(says(first.count("d").unwrap_err()), "/a/0/d: not a whole number, 0 or more");
        assert_eq!(says(first.count("e").unwrap_err()), "/a/0/e: not a whole number, 0 or more");
        assert_eq!(says(first.numbers::<3>("d").unwrap_err()), "/a/0/d: not a list of 3 numbers");
        assert_eq!(says(first.text("b/c").unwrap_err()), "/a/0/b~1c: not text");
        assert_eq!(says(first.needed("g").unwrap_err()), "/a/0: `g` is missing");
        assert_eq!(root.list("a").unwrap()[0].object("b").unwrap().len(), 0);
    }
}
