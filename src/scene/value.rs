//! Values of a scene file with their names, places and error messages.

use std::borrow::Cow;
use std::ops::Range;

use glam::DVec3;
use toml::Spanned;
use toml::de::DeValue;

use super::error::Fault;
use super::nearest::nearest;
use super::rule::Rule;
use super::table::{Table, in_order};

/// A value with its place in the text.
pub(super) type Node<'t> = Spanned<DeValue<'t>>;

/// A value of a table, or an element of a list value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Value<'t> {
    table: &'t Table<'t>,
    /// Its key.
    pub key: &'static str,
    /// Its index in a list, and in a nested list.
    index: [Option<usize>; 2],
    node: &'t Node<'t>,
}

impl<'t> Value<'t> {
    /// The value of `key` in `table`.
    pub fn new(table: &'t Table<'t>, key: &'static str, node: &'t Node<'t>) -> Self {
        let index = [None; 2];
        Self {
            table,
            key,
            index,
            node,
        }
    }

    /// An error of this value: `sphere radius` + `what` + `, got -0.5`.
    pub fn fault(&self, what: &str, help: impl Into<String>) -> Fault {
        self.fault_of(self.node, what, help)
    }

    /// The error of a value that breaks `rule`.
    fn broken(&self, rule: &Rule) -> Fault {
        let (problem, remedy) =
            number(self.node).map_or((rule.words, rule.help), |x| (rule.problem(x), rule.remedy(x)));
        self.fault(problem, remedy)
    }

    /// An error of the number at `component` of this vector or colour, or of the whole value without one.
    pub fn fault_in(&self, component: Option<usize>, what: &str, help: &str) -> Fault {
        let node = match (self.node.get_ref(), component) {
            (DeValue::Array(items), Some(component)) => items.get(component).unwrap_or(self.node),
            _ => self.node,
        };
        self.fault_of(node, what, help)
    }

    fn fault_of(&self, node: &Node<'_>, what: &str, help: impl Into<String>) -> Fault {
        let got = shown(self.table.text, node.span());
        Fault::new(format!("{} {what}, got {got}", self.name()), help)
            .at(node.span(), format!("in {}", self.table.title))
    }

    /// Its name in a message: `sphere radius`, `mesh vertices[3]`, `mesh faces[3][0]`.
    fn name(&self) -> String {
        let indices: String = self.index.iter().flatten().map(|index| format!("[{index}]")).collect();
        format!("{} {}{indices}", self.table.thing, self.key)
    }

    /// Its byte range, and the label below it.
    pub fn place(&self) -> (Range<usize>, String) {
        (self.node.span(), format!("in {}", self.table.title))
    }

    /// One number; integers are accepted.
    pub fn number(&self) -> Result<f64, Fault> {
        let help = "write a number, such as 1.5";
        number(self.node).ok_or_else(|| self.fault("must be a number", help))
    }

    /// One number that is not stored in a scene, so its rule is checked here.
    pub fn ruled(&self, rule: &Rule) -> Result<f64, Fault> {
        let x = self.number()?;
        if rule.holds(x) { Ok(x) } else { Err(self.broken(rule)) }
    }

    /// `N` numbers in brackets.
    pub fn numbers<const N: usize>(&self) -> Result<[f64; N], Fault> {
        let (words, help) = match N {
            3 => (
                "must be three numbers",
                "write three numbers in brackets, such as [1, 0.5, 2]",
            ),
            2 => ("must be two numbers", "write two numbers in brackets, such as [0.5, 1]"),
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
        }
        Ok(values)
    }

    /// Three numbers in brackets.
    pub fn triple(&self) -> Result<DVec3, Fault> {
        self.numbers::<3>().map(DVec3::from_array)
    }

    /// `N` numbers, each checked by a rule here.
    pub fn ruled_numbers<const N: usize>(&self, rule: &Rule) -> Result<[f64; N], Fault> {
        let numbers = self.numbers::<N>()?;
        match numbers.iter().position(|&x| !rule.holds(x)) {
            None => Ok(numbers),
            component @ Some(at) => Err(self.fault_in(component, rule.problem(numbers[at]), rule.remedy(numbers[at]))),
        }
    }

    /// Three numbers, each checked by a rule here.
    pub fn ruled_triple(&self, rule: &Rule) -> Result<DVec3, Fault> {
        self.ruled_numbers::<3>(rule).map(DVec3::from_array)
    }

    /// An integer from `least` to `most`.
    pub fn whole(&self, least: u32, most: u32) -> Result<u32, Fault> {
        self.index().filter(|n| (least..=most).contains(n)).ok_or_else(|| {
            let example = if least == 0 { 0 } else { 64 };
            let help = format!("write a whole number without quotes or a point, such as {example}");
            self.fault(&format!("must be a whole number from {least} to {most}"), help)
        })
    }

    /// An integer from 0 to `u32::MAX`; `None` for anything else.
    pub fn index(&self) -> Option<u32> {
        match self.node.get_ref() {
            DeValue::Integer(digits) => u32::from_str_radix(digits.as_str(), digits.radix()).ok(),
            _ => None,
        }
    }

    /// `true` or `false`.
    pub fn truth(&self) -> Result<bool, Fault> {
        match self.node.get_ref() {
            DeValue::Boolean(truth) => Ok(*truth),
            _ => Err(self.fault("must be true or false", "write true or false, without quotes")),
        }
    }

    /// A string.
    pub fn string(&self) -> Result<&'t str, Fault> {
        match self.node.get_ref() {
            DeValue::String(string) => Ok(string),
            _ => Err(self.fault("must be a string", "write a name in quotes, such as \"floor\"")),
        }
    }

    /// The one of `choices` with this name.
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

    /// The elements of a list of tables, such as `[[spheres]]`: titled `[[spheres]] 1`, and `thing` before a key.
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

    /// The named subtables, such as `[materials.floor]`, in text order.
    pub fn named_tables(&self, thing: &'static str, keys: &[&str]) -> Result<Vec<(&'t str, Table<'t>)>, Fault> {
        let DeValue::Table(entries) = self.node.get_ref() else {
            return Err(self.fault(
                "must be tables",
                format!("write one table each, such as [{}.floor]", self.key),
            ));
        };
        let named = |(key, node): (&'t Spanned<Cow<'t, str>>, &'t Node<'t>)| {
            let name = key.get_ref().as_ref();
            let table = Table::new(self.table.text, node, format!("[{}.{name}]", self.key), thing, keys)?;
            Ok((name, table))
        };
        in_order(entries).into_iter().map(named).collect()
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

/// The text of a value in one line, abbreviated if necessary.
pub(super) fn shown(text: &str, span: Range<usize>) -> String {
    const LONGEST: usize = 60;
    // A value can be a whole mesh: take no more than can be shown.
    let words: String = text.get(span).unwrap_or_default().chars().take(4 * LONGEST).collect();
    let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
    match words.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &words[..end]),
        None => words,
    }
}
