//! Configurations in TOML.
//!
//! `module` names the kind of module, `[global]` holds global parameters, `[axis.0]` those of axis 0; names are those of `gradus
//! params`, in any spelling that finds them. The comment behind a value tells unit, meaning and default. It is renewed with the
//! value as long as nobody has changed it; all other comments are the user's and stay.

use std::fmt::Write;

use gradus_tmcl::catalogue::{MODULES, Module};
use toml_edit::{Document, DocumentMut, Item, Table, Value};

use super::{Config, Setting};
use crate::names::find_among_globals;
use crate::{NameError, find_axis};

/// What is wrong with a configuration file: one line a problem, `FILE:LINE: what`.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{}", problems.join("\n"))]
pub struct ConfigFileError {
    /// The problems, in the order of the file.
    pub problems: Vec<String>,
}

const GLOBAL: &str = "global";
const AXIS: &str = "axis";
const MODULE: &str = "module";

/// A text that is being read.
struct Reading<'a> {
    name: &'a str,
    document: &'a Document<&'a str>,
    problems: Vec<String>,
}

impl Config {
    /// Reads a configuration; `name` is that of its file, for problems.
    ///
    /// ```
    /// use gradus_host::{Config, Session};
    ///
    /// let config = Config::parse("module = 'TMCM-3351'\n[axis.0]\nmaximum_current = 200", "stage.toml")?;
    /// let mut session = Session::open(&"sim:tmcm-3351".parse()?)?;
    /// assert_eq!(config.apply(&mut session, |_| {})?.len(), 1);
    /// assert!(config.differences(&mut session, |_| {})?.is_empty());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Lists all problems.
    pub fn parse(text: &str, name: &str) -> Result<Self, ConfigFileError> {
        let document = Document::parse(text).map_err(|error| {
            let line = line(text, error.span().map(|span| span.start));
            ConfigFileError { problems: vec![format!("{name}:{line}: {}", error.message())] }
        })?;
        let mut reading = Reading { name, document: &document, problems: Vec::new() };
        let config = reading.config();
        match config {
            Some(config) if reading.problems.is_empty() => Ok(config),
            _ => Err(ConfigFileError { problems: reading.problems }),
        }
    }

    /// The configuration as a new file.
    pub fn to_toml(&self) -> String {
        let (major, minor) = self.module.version;
        let head = format!("# {}, firmware {major}.{minor}\n{MODULE} = \"{}\"\n", self.module.name, self.module.name);
        self.update(&head).unwrap_or(head)
    }

    /// A file with the values of this configuration in their places; comments and order stay, settings that are missing come
    /// at the end of their table. The file must be right, see [`parse`](Self::parse).
    ///
    /// # Errors
    /// When the text is no TOML.
    pub fn update(&self, text: &str) -> Result<String, ConfigFileError> {
        let document = text.parse::<DocumentMut>();
        let mut document = document.map_err(|error| ConfigFileError { problems: vec![error.message().into()] })?;
        let spellings = spellings(document.as_table(), self.module);
        for (setting, value) in &self.values {
            let spelling = spellings.iter().find(|(spelt, _)| spelt == setting);
            let key = spelling.map_or_else(|| setting.named.name(), |(_, key)| key.clone());
            if let Some(table) = table_of(&mut document, setting) {
                put(table, &key, setting, *value, self.is_internal(setting.axis));
            }
        }
        Ok(document.to_string())
    }
}

/// The table that holds a setting; made if it is missing.
fn table_of<'a>(document: &'a mut DocumentMut, setting: &Setting) -> Option<&'a mut Table> {
    let root = document.as_table_mut();
    if let crate::Named::Global { .. } = setting.named {
        return root.entry(GLOBAL).or_insert(spaced_table()).as_table_mut();
    }
    let mut axes = Table::new();
    axes.set_implicit(true);
    let axes = root.entry(AXIS).or_insert(Item::Table(axes)).as_table_mut()?;
    axes.entry(&setting.axis.to_string()).or_insert(spaced_table()).as_table_mut()
}

fn spaced_table() -> Item {
    let mut table = Table::new();
    table.decor_mut().set_prefix("\n");
    Item::Table(table)
}

/// How a file spells its settings.
fn spellings(root: &Table, module: &'static Module) -> Vec<(Setting, String)> {
    let tables = (0..module.axes).filter_map(|axis| Some((axis, root.get(AXIS)?.get(axis.to_string())?.as_table()?)));
    let axes = tables.flat_map(|(axis, table)| {
        table
            .iter()
            .filter_map(move |(key, _)| Some((Setting { named: find_axis(module, key).ok()?, axis }, key.to_owned())))
    });
    let global = root.get(GLOBAL).and_then(Item::as_table).into_iter().flat_map(Table::iter);
    let global = global.filter_map(|(key, _)| {
        Some((Setting { named: find_among_globals(module, key).ok()?, axis: 0 }, key.to_owned()))
    });
    axes.chain(global).collect()
}

/// Puts a value in place of the old one, or at the end.
fn put(table: &mut Table, key: &str, setting: &Setting, value: i64, internal: bool) {
    let mut fresh = Value::from(value);
    let note = format!(" # {}", setting.note(value, internal));
    let Some(old) = table.get_mut(key).and_then(Item::as_value_mut) else {
        fresh.decor_mut().set_suffix(note);
        table.insert(key, Item::Value(fresh));
        return;
    };
    *fresh.decor_mut() = old.decor().clone();
    let suffix = old.decor().suffix().and_then(|suffix| suffix.as_str()).unwrap_or_default();
    let is_ours =
        |old| [false, true].iter().any(|internal| suffix.trim() == format!("# {}", setting.note(old, *internal)));
    if old.as_integer().is_some_and(is_ours) {
        fresh.decor_mut().set_suffix(note);
    }
    *old = fresh;
}

impl Reading<'_> {
    fn config(&mut self) -> Option<Config> {
        let document = self.document;
        let root = document.as_table();
        let module = self.module(root);
        for (key, _) in root.iter().filter(|(key, _)| ![MODULE, GLOBAL, AXIS].contains(key)) {
            self.problem(root, key, "expected are `module`, [global] and [axis.N]");
        }
        let mut config = Config { module: module?, values: Vec::new() };
        if let Some(table) = self.table(root, GLOBAL) {
            let find = |key: &str| find_among_globals(config.module, key);
            let values = self.values(table, 0, find);
            config.values.extend(values);
        }
        if let Some(axes) = self.table(root, AXIS) {
            for (key, _) in axes.iter() {
                let values = self.axis(config.module, axes, key);
                config.values.extend(values);
            }
        }
        self.check_once(&config);
        Some(config)
    }

    fn module(&mut self, root: &Table) -> Option<&'static Module> {
        let names = || MODULES.iter().map(|module| module.name).collect::<Vec<_>>().join(", ");
        let Some(item) = root.get(MODULE) else {
            self.problems.push(format!("{}:1: `module` is missing; it is one of {}", self.name, names()));
            return None;
        };
        let module = item.as_str().and_then(Module::named);
        if module.is_none() {
            self.problem(root, MODULE, &format!("`module` is one of {}", names()));
        }
        module
    }

    fn table<'t>(&mut self, parent: &'t Table, key: &str) -> Option<&'t Table> {
        let item = parent.get(key)?;
        if item.as_table().is_none() {
            self.problem(parent, key, &format!("`{key}` is a table, written [{key}]"));
        }
        item.as_table()
    }

    fn axis(&mut self, module: &'static Module, axes: &Table, key: &str) -> Vec<(Setting, i64)> {
        let Some(axis) = key.parse().ok().filter(|axis| *axis < module.axes) else {
            self.problem(axes, key, &format!("the {} has the axes 0 to {}", module.name, module.axes - 1));
            return Vec::new();
        };
        let Some(table) = self.table(axes, key) else { return Vec::new() };
        self.values(table, axis, |key| find_axis(module, key))
    }

    fn values(
        &mut self,
        table: &Table,
        axis: u8,
        find: impl Fn(&str) -> Result<crate::Named, NameError>,
    ) -> Vec<(Setting, i64)> {
        let mut values = Vec::new();
        for (key, item) in table.iter() {
            match find(key).map(|named| Setting { named, axis }) {
                Err(error) => self.problem(table, key, &error.to_string()),
                Ok(setting) => match value(&setting, item) {
                    Ok(value) => values.push((setting, value)),
                    Err(problem) => self.problem(table, key, &problem),
                },
            }
        }
        values
    }

    fn check_once(&mut self, config: &Config) {
        for (index, (setting, _)) in config.values.iter().enumerate() {
            if config.values[..index].iter().any(|(earlier, _)| earlier == setting) {
                self.problems.push(format!("{}: {setting} is set twice, under two spellings", self.name));
            }
        }
    }

    fn problem(&mut self, table: &Table, key: &str, problem: &str) {
        let start = table.key(key).and_then(|key| key.span()).map(|span| span.start);
        let mut text = format!("{}:{}: ", self.name, line(self.document.raw(), start));
        let _ = write!(text, "{problem}"); // a String takes everything
        self.problems.push(text);
    }
}

fn value(setting: &Setting, item: &Item) -> Result<i64, String> {
    if !setting.is_setting() {
        return Err(format!("{} is no setting; `gradus config dump` shows what is", setting.named));
    }
    let value = item.as_integer().filter(|value| setting.takes(*value));
    value.ok_or_else(|| format!("{} takes {}", setting.named, setting.named.range()))
}

impl Setting {
    /// True for values that the module shows after it has been written.
    fn takes(&self, value: i64) -> bool {
        if self.is(gradus_tmcl::catalogue::Gp::EepromLock) {
            return (0..=1).contains(&value);
        }
        self.named.encode(value).is_some_and(|value| self.named.accepts(value))
    }
}

/// Number of the line at a byte.
fn line(text: &str, start: Option<usize>) -> usize {
    1 + text.bytes().take(start.unwrap_or_default()).filter(|byte| *byte == b'\n').count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings;

    #[test]
    fn every_setting_of_every_module_survives_the_file() {
        for module in MODULES {
            let config = Config::defaults(module);
            assert_eq!(config.values.len(), settings(module).count());
            let read = Config::parse(&config.to_toml(), "x.toml").unwrap();
            assert_eq!(read.values, config.values, "{}", module.name);
            assert_eq!(read.to_toml(), config.to_toml());
        }
    }
}
