//! The TOML tree of a scene file: tables that know their keys, values that know their names and places.

use std::ops::Range;

use glam::DVec3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::Fault;
use super::nearest::nearest;

/// A value with its place in the text.
pub(super) type Node<'t> = Spanned<DeValue<'t>>;

/// What a number must be.
pub(super) struct Rule {
    words: &'static str,
    help: &'static str,
    holds: fn(f64) -> bool,
}

impl Rule {
    /// Whether `x` is what it must be.
    pub fn holds(&self, x: f64) -> bool {
        (self.holds)(x)
    }
}

// Packets compute in single precision: a number beyond its range would be infinite there.
fn in_range(x: f64) -> bool {
    x.abs() <= f64::from(f32::MAX)
}

/// Any number that single precision can hold.
pub(super) const FINITE: Rule = Rule {
    words: "must be finite",
    help: "write a number between -3.4e38 and 3.4e38",
    holds: in_range,
};
/// Above 0.
pub(super) const POSITIVE: Rule = Rule {
    words: "must be positive and finite",
    help: "write a number above 0, at most 3.4e38",
    holds: |x| x >= f64::from(f32::MIN_POSITIVE) && in_range(x),
};
/// 0 or above.
pub(super) const NOT_NEGATIVE: Rule = Rule {
    words: "must be finite and not negative",
    help: "write numbers from 0 to 3.4e38, one each for red, green and blue",
    holds: |x| x >= 0.0 && in_range(x),
};
/// Anything but 0.
pub(super) const NOT_ZERO: Rule = Rule {
    words: "must be finite and not 0",
    help: "write a number other than 0: 2 doubles the mesh, 0.5 halves it, -1 mirrors it",
    holds: |x| x != 0.0 && in_range(x),
};
/// A Phong exponent.
pub(super) const EXPONENT: Rule = Rule {
    words: "must be above 1 and finite",
    help: "write a number above 1: 5 is dull, 1000 is polished; a matt surface is `diffuse = [r, g, b]`",
    holds: |x| x > 1.0 && in_range(x),
};
/// The fourth number of `brdf_params`.
pub(super) const ALPHA: Rule = Rule {
    words: "must have an alpha of 1 (diffuse) or above 1 (Phong)",
    help: "write [r, g, b, 1] for a diffuse surface or, say, [r, g, b, 1000] for a Phong one",
    holds: |x| x >= 1.0 && in_range(x),
};
/// A full angle of view.
pub(super) const VIEW_ANGLE: Rule = Rule {
    words: "must be between 0 and 180 degrees",
    help: "write the full angle of view in degrees, such as 45",
    holds: |x| x > 0.0 && x < 180.0,
};

/// A table of the file: every key in it is one of those that it may have.
#[derive(Clone, Debug)]
pub(super) struct Table<'t> {
    /// As the user wrote it: `[camera]`, `[materials.steel]`, `[[spheres]] 3` (the third).
    pub title: String,
    /// Where its header stands.
    pub span: Range<usize>,
    thing: &'static str,
    entries: &'t DeTable<'t>,
    text: &'t str,
}

impl<'t> Table<'t> {
    /// The table at `node`, called `title` as a whole and `thing` before the name of a key.
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
        let Some((key, _)) = self
            .in_order()
            .into_iter()
            .find(|(key, _)| !keys.contains(&key.get_ref().as_ref()))
        else {
            return Ok(());
        };
        // Not "[[spheres]] 3": they all have the same keys.
        let kind = self.title.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end();
        let list = format!("the keys of {kind} are {}", keys.join(", "));
        let help = match nearest(key.get_ref(), keys.iter().copied()) {
            Some(near) => format!("did you mean `{near}`? {list}"),
            None => list,
        };
        let what = format!("{} has an unknown key, got `{}`", self.title, key.get_ref());
        Err(Fault::new(what, help).at(key.span(), "not a key of this table"))
    }

    /// Its entries as they follow in the text (the tree sorts them by name).
    pub fn in_order(&self) -> Vec<(&'t Spanned<std::borrow::Cow<'t, str>>, &'t Node<'t>)> {
        let mut entries: Vec<_> = self.entries.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        entries
    }

    /// The value of `key`, if the table has it.
    pub fn get(&self, key: &'static str) -> Option<Value<'_>> {
        self.entries.get(key).map(|node| Value {
            table: self,
            key,
            index: [None; 2],
            node,
        })
    }

    /// The value of `key`.
    ///
    /// # Errors
    /// If it is not there; the help shows `example`, a line that could be added.
    pub fn need(&self, key: &'static str, example: &str) -> Result<Value<'_>, Fault> {
        self.get(key)
            .ok_or_else(|| self.fault(format!("{} has no {key}", self.title), format!("add `{example}`")))
    }

    /// Which one of two keys the table has.
    ///
    /// # Errors
    /// If it has both or neither.
    pub fn one_of(&self, a: &'static str, b: &'static str, help: &str) -> Result<Value<'_>, Fault> {
        match (self.get(a), self.get(b)) {
            (Some(value), None) | (None, Some(value)) => Ok(value),
            (Some(_), Some(b_value)) => {
                let what = format!("{} must have {a} or {b}, got both", self.title);
                Err(Fault::new(what, help).at(b_value.node.span(), "one of the two is too much"))
            }
            (None, None) => Err(self.fault(format!("{} must have {a} or {b}, got neither", self.title), help)),
        }
    }

    /// A fault of the table as a whole.
    pub fn fault(&self, what: impl Into<String>, help: impl Into<String>) -> Fault {
        Fault::new(what, help).at(self.span.clone(), "this table")
    }
}

/// A value of a table, or an element of a list that is one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Value<'t> {
    table: &'t Table<'t>,
    /// Its key.
    pub key: &'static str,
    /// Its place in a list, and in a list inside of that.
    index: [Option<usize>; 2],
    node: &'t Node<'t>,
}

impl<'t> Value<'t> {
    /// A fault of this value: `sphere radius` + `what` + `, got -0.5`.
    pub fn fault(&self, what: &str, help: impl Into<String>) -> Fault {
        self.fault_of(self.node, what, help)
    }

    /// The fault of a value that breaks `rule`.
    pub fn broken(&self, rule: &Rule) -> Fault {
        self.broken_at(self.node, rule)
    }

    fn broken_at(&self, node: &Node<'_>, rule: &Rule) -> Fault {
        match number(node) {
            // To call 1e39 not finite would be wrong.
            Some(x) if x.is_finite() && !in_range(x) => self.fault_of(node, "is beyond single precision", rule.help),
            _ => self.fault_of(node, rule.words, rule.help),
        }
    }

    fn fault_of(&self, node: &Node<'_>, what: &str, help: impl Into<String>) -> Fault {
        let got = shown(self.table.text, node.span());
        Fault::new(format!("{} {what}, got {got}", self.name()), help)
            .at(node.span(), format!("in {}", self.table.title))
    }

    /// What a message calls it: `sphere radius`, `mesh vertices[3]`, `mesh faces[3][0]`.
    fn name(&self) -> String {
        let indices: String = self.index.iter().flatten().map(|index| format!("[{index}]")).collect();
        format!("{} {}{indices}", self.table.thing, self.key)
    }

    /// Its place, and the words that belong under it.
    pub fn place(&self) -> (Range<usize>, String) {
        (self.node.span(), format!("in {}", self.table.title))
    }

    /// One number; a whole number will do.
    pub fn number(&self, rule: &Rule) -> Result<f64, Fault> {
        let help = "write a number, such as 1.5";
        let x = number(self.node).ok_or_else(|| self.fault("must be a number", help))?;
        if rule.holds(x) { Ok(x) } else { Err(self.broken(rule)) }
    }

    /// `N` numbers in brackets, the same rule for each.
    pub fn numbers<const N: usize>(&self, rule: &Rule) -> Result<[f64; N], Fault> {
        let (words, help) = match N {
            3 => (
                "must be three numbers",
                "write three numbers in brackets, such as [1, 0.5, 2]",
            ),
            _ => (
                "must be four numbers",
                "write four numbers in brackets, such as [0.4, 0.4, 0.4, 1000]",
            ),
        };
        let wrong = || self.fault(words, help);
        let DeValue::Array(items) = self.node.get_ref() else {
            return Err(wrong());
        };
        if items.len() != N {
            return Err(wrong());
        }
        let mut values = [0.0; N];
        for (value, item) in values.iter_mut().zip(items.iter()) {
            *value = number(item).ok_or_else(wrong)?;
            if !rule.holds(*value) {
                return Err(self.broken_at(item, rule));
            }
        }
        Ok(values)
    }

    /// Three numbers in brackets.
    pub fn triple(&self, rule: &Rule) -> Result<DVec3, Fault> {
        self.numbers::<3>(rule).map(DVec3::from_array)
    }

    /// A whole number from `least` to `most`.
    pub fn whole(&self, least: u32, most: u32) -> Result<u32, Fault> {
        self.index().filter(|n| (least..=most).contains(n)).ok_or_else(|| {
            let example = if least == 0 { 0 } else { 64 };
            let help = format!("write a whole number without quotes or a point, such as {example}");
            self.fault(&format!("must be a whole number from {least} to {most}"), help)
        })
    }

    /// A whole number from 0 to `u32::MAX`; `None` for anything else.
    pub fn index(&self) -> Option<u32> {
        match self.node.get_ref() {
            DeValue::Integer(digits) => u32::from_str_radix(digits.as_str(), digits.radix()).ok(),
            _ => None,
        }
    }

    /// A string.
    pub fn string(&self) -> Result<&'t str, Fault> {
        match self.node.get_ref() {
            DeValue::String(string) => Ok(string),
            _ => Err(self.fault("must be a string", "write a name in quotes, such as \"floor\"")),
        }
    }

    /// The one of `choices` that has this name.
    pub fn choice<T: Copy>(&self, choices: &[T], name: fn(T) -> &'static str) -> Result<T, Fault> {
        let string = self.string()?;
        choices
            .iter()
            .copied()
            .find(|&choice| name(choice) == string)
            .ok_or_else(|| {
                let names: Vec<_> = choices.iter().map(|&choice| name(choice)).collect();
                let help = match nearest(string, names.iter().copied()) {
                    Some(near) => format!("did you mean \"{near}\"?"),
                    None => format!("write one of these names in quotes, such as \"{}\"", names[0]),
                };
                self.fault(&format!("must be one of {}", names.join(", ")), help)
            })
    }

    /// The elements of a list.
    pub fn list(&self, help: &str) -> Result<impl ExactSizeIterator<Item = Value<'t>> + use<'t>, Fault> {
        let DeValue::Array(items) = self.node.get_ref() else {
            return Err(self.fault("must be a list", help));
        };
        let Self {
            table,
            key,
            index: outer,
            ..
        } = *self;
        let element = move |(index, node)| {
            let index = if outer[0].is_none() {
                [Some(index), None]
            } else {
                [outer[0], Some(index)]
            };
            Value {
                table,
                key,
                index,
                node,
            }
        };
        Ok(items.iter().enumerate().map(element))
    }

    /// The elements of a list of tables, `[[spheres]]`: called `[[spheres]] 1`, and `thing` before the name of a key.
    pub fn tables(&self, thing: &'static str, keys: &[&str]) -> Result<Vec<Table<'t>>, Fault> {
        let help = format!("begin each {thing} with a line [[{}]]", self.key);
        let title = |index: usize| format!("[[{}]] {}", self.key, index + 1);
        let items = self.list(&help)?.enumerate();
        items
            .map(|(index, item)| Table::new(self.table.text, item.node, title(index), thing, keys))
            .collect()
    }

    /// This value as a table.
    pub fn table(&self, title: String, thing: &'static str, keys: &[&str]) -> Result<Table<'t>, Fault> {
        Table::new(self.table.text, self.node, title, thing, keys)
    }

    /// The named tables inside this one, `[materials.floor]`, in the order of the text.
    pub fn named_tables(&self, thing: &'static str, keys: &[&str]) -> Result<Vec<(&'t str, Table<'t>)>, Fault> {
        let DeValue::Table(entries) = self.node.get_ref() else {
            return Err(self.fault(
                "must be tables",
                format!("write one table each, such as [{}.floor]", self.key),
            ));
        };
        let mut entries: Vec<_> = entries.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        let named = |(key, node): (&'t Spanned<std::borrow::Cow<'t, str>>, &'t Node<'t>)| {
            let name = key.get_ref().as_ref();
            let table = Table::new(self.table.text, node, format!("[{}.{name}]", self.key), thing, keys)?;
            Ok((name, table))
        };
        entries.into_iter().map(named).collect()
    }

    /// `true` for a list.
    pub fn is_list(&self) -> bool {
        matches!(self.node.get_ref(), DeValue::Array(_))
    }
}

fn number(node: &Node<'_>) -> Option<f64> {
    match node.get_ref() {
        DeValue::Float(digits) => digits.as_str().parse().ok(),
        DeValue::Integer(digits) if digits.radix() == 10 => digits.as_str().parse().ok(),
        DeValue::Integer(digits) => i64::from_str_radix(digits.as_str(), digits.radix())
            .ok()
            .map(|whole| whole as f64),
        _ => None,
    }
}

/// The text of a value in one line, shortened if need be.
fn shown(text: &str, span: Range<usize>) -> String {
    const LONGEST: usize = 60;
    // A value can be a whole mesh: look at no more of it than can be shown.
    let words: String = text.get(span).unwrap_or_default().chars().take(4 * LONGEST).collect();
    let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
    match words.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &words[..end]),
        None => words,
    }
}
