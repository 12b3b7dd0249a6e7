//! Tables of a scene file with their names, places and keys.

use std::borrow::Cow;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::Fault;
use super::nearest::nearest;
use super::value::{Node, Value, shown};

/// A table of the file whose keys are all valid.
#[derive(Clone, Debug)]
pub(super) struct Table<'t> {
    /// As the user wrote it: `[camera]`, `[materials.steel]`, `[[spheres]] 3` (the third).
    pub title: String,
    /// The byte range of its header.
    pub span: Range<usize>,
    /// Its name before a key in messages: `sphere`.
    pub thing: &'static str,
    /// The whole file.
    pub text: &'t str,
    entries: &'t DeTable<'t>,
}

impl<'t> Table<'t> {
    /// The table at `node`, named `title` as a whole and `thing` before a key.
    ///
    /// # Errors
    /// If it is not a table, or holds a key that is not one of `keys`.
    pub fn new(
        text: &'t str,
        node: &'t Node<'t>,
        title: String,
        thing: &'static str,
        keys: &[&str],
    ) -> Result<Self, Fault> {
        let DeValue::Table(entries) = node.get_ref() else {
            let what = format!("{title} must be a table, got {}", shown(text, node.span()));
            return Err(
                Fault::new(what, format!("write a table with the keys {}", keys.join(", "))).at(node.span(), "this"),
            );
        };
        let table = Self {
            title,
            span: node.span(),
            thing,
            entries,
            text,
        };
        table.only(keys)?;
        Ok(table)
    }

    /// The whole file.
    ///
    /// # Errors
    /// If it holds a key that is not one of `keys`.
    pub fn root(text: &'t str, entries: &'t DeTable<'t>, keys: &[&str]) -> Result<Self, Fault> {
        let table = Self {
            title: "the scene".to_owned(),
            span: 0..0,
            thing: "scene",
            entries,
            text,
        };
        table.only(keys)?;
        Ok(table)
    }

    fn only(&self, keys: &[&str]) -> Result<(), Fault> {
        let Some((key, _)) = in_order(self.entries)
            .into_iter()
            .find(|(key, _)| !keys.contains(&key.get_ref().as_ref()))
        else {
            return Ok(());
        };
        // Without the number: all tables of a list have the same keys.
        let kind = self.title.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end();
        let list = format!("the keys of {kind} are {}", keys.join(", "));
        let help = match nearest(key.get_ref(), keys.iter().copied()) {
            Some(near) => format!("did you mean `{near}`? {list}"),
            None => list,
        };
        let what = format!("{} has an unknown key, got `{}`", self.title, key.get_ref());
        Err(Fault::new(what, help).at(key.span(), "not a key of this table"))
    }

    /// The value of `key`, if the table has it.
    pub fn get(&self, key: &'static str) -> Option<Value<'_>> {
        self.entries.get(key).map(|node| Value::new(self, key, node))
    }

    /// The value of `key`.
    ///
    /// # Errors
    /// If it is missing; the help shows `example`, a line that could be added.
    pub fn need(&self, key: &'static str, example: &str) -> Result<Value<'_>, Fault> {
        self.get(key)
            .ok_or_else(|| self.fault(format!("{} has no {key}", self.title), format!("add `{example}`")))
    }

    /// Returns which one of two keys the table has.
    ///
    /// # Errors
    /// If it has both or neither.
    pub fn one_of(&self, a: &'static str, b: &'static str, help: &str) -> Result<Value<'_>, Fault> {
        match (self.get(a), self.get(b)) {
            (Some(value), None) | (None, Some(value)) => Ok(value),
            (Some(_), Some(b_value)) => {
                let what = format!("{} must have {a} or {b}, got both", self.title);
                Err(Fault::new(what, help).at(b_value.place().0, "delete one of the two"))
            }
            (None, None) => Err(self.fault(format!("{} must have {a} or {b}, got neither", self.title), help)),
        }
    }

    /// An error of the table as a whole.
    pub fn fault(&self, what: impl Into<String>, help: impl Into<String>) -> Fault {
        Fault::new(what, help).at(self.span.clone(), "this table")
    }
}

/// The entries of a table in text order (the tree sorts them by name).
pub(super) fn in_order<'t>(entries: &'t DeTable<'t>) -> Vec<(&'t Spanned<Cow<'t, str>>, &'t Node<'t>)> {
    let mut entries: Vec<_> = entries.iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    entries
}
