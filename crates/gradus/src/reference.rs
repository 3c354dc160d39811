//! A module's tables as a page of the book.

use std::fmt::{self, Write};

use gradus_host::normalise;
use gradus_tmcl::catalogue::{
    Access, AxisParameter, COMMANDS, Choice, Command, Direction, GlobalParameter, Interrupt, Mode, Module, Port, Values,
};

/// The page in Markdown.
///
/// # Errors
/// Never; a text takes all that is written.
pub fn page(module: &Module) -> Result<String, fmt::Error> {
    let mut page = String::new();
    let (major, minor) = module.version;
    writeln!(page, "# {}: parameters, ports and commands\n", module.name)?;
    writeln!(
        page,
        "Made from the catalogue by `gradus params --module {} --markdown`: what is checked and stored is",
        module.name.to_lowercase()
    )?;
    writeln!(
        page,
        "read from the same rows. Firmware {major}.{minor:02}; axes: {}; commands of a program: {}.\n",
        module.axes, module.program_len
    )?;
    writeln!(
        page,
        "Access: R read only, RW read and write, RWE stored in the EEPROM on demand, RWA stored in the EEPROM at every\nwrite."
    )?;
    table(&mut page, "Axis parameters", &AXIS, module.axis_parameters.iter().map(axis))?;
    table(&mut page, "Global parameters", &GLOBAL, module.global_parameters.iter().map(global))?;
    table(&mut page, "Ports", &["bank", "port", "name", "command", "range"], module.ports.iter().map(port))?;
    table(&mut page, "Interrupts", &["number", "name", "in programs"], module.interrupts.iter().map(interrupt))?;
    let commands = COMMANDS.iter().filter_map(|row| command(row, row.modes.of(module.model)));
    table(&mut page, "Commands", &["number", "command", "what it does", "where"], commands)?;
    Ok(page)
}

const AXIS: [&str; 4] = ["AP", "name", "meaning", "range, default, access"];
const GLOBAL: [&str; 4] = ["bank, GP", "name", "meaning", "range, default, access"];

/// A heading with a table under it; nothing where there are no rows.
fn table<const N: usize>(
    page: &mut String,
    heading: &str,
    columns: &[&str; N],
    rows: impl Iterator<Item = [String; N]>,
) -> fmt::Result {
    let mut rows = rows.peekable();
    if rows.peek().is_none() {
        return Ok(());
    }
    writeln!(page, "\n## {heading}\n\n| {} |\n|{}", columns.join(" | "), "---|".repeat(N))?;
    for row in rows {
        writeln!(page, "| {} |", row.map(|cell| cell.replace('|', "\\|")).join(" | "))?;
    }
    Ok(())
}

fn axis(row: &AxisParameter) -> [String; 4] {
    let name = format!("`{}`<br>`{}`", normalise(row.name), row.symbol);
    let facts = facts(&range(row.min, row.max), row.unit.text(), row.default, row.access);
    [row.number.to_string(), name, meaning(row.description, row.values), facts]
}

fn global(row: &GlobalParameter) -> [String; 4] {
    let numbers = if row.first == row.last { row.first.to_string() } else { range(row.first.into(), row.last.into()) };
    let facts = facts(&range(row.min, row.max), "", row.default, row.access);
    let name = format!("`{}`<br>`{}`", normalise(row.name), row.symbol);
    [format!("{}, {numbers}", row.bank), name, meaning(row.description, row.values), facts]
}

fn facts(range: &str, unit: &str, default: Option<i64>, access: Access) -> String {
    let default = default.map(|value| format!("default {value}<br>")).unwrap_or_default();
    format!("{range} {unit}<br>{default}{}", access.text()).replace(" <", "<")
}

fn port(row: &Port) -> [String; 5] {
    let command = if row.direction == Direction::In { "GIO" } else { "SIO, GIO" };
    let range = row.range.map_or_else(String::new, |(min, max)| range(min.into(), max.into()));
    [row.bank.to_string(), row.number.to_string(), row.name.into(), command.into(), range]
}

fn interrupt(row: &Interrupt) -> [String; 3] {
    [row.number.to_string(), row.name.into(), format!("`{}`", row.symbol)]
}

fn command(row: &Command, mode: Mode) -> Option<[String; 4]> {
    let place = match mode {
        Mode::None => return None,
        Mode::Direct => "direct mode",
        Mode::Standalone => "programs",
        Mode::Both => "direct mode, programs",
    };
    let syntax = if row.mnemonic.is_empty() { String::new() } else { format!("`{row}`") };
    Some([row.opcode.0.to_string(), syntax, row.name.into(), place.into()])
}

fn range(min: i64, max: i64) -> String {
    format!("{min} to {max}")
}

/// The description, and what the values mean.
fn meaning(description: &str, values: Values) -> String {
    let lists: &[(&str, &[Choice])] = match values {
        Values::Any => &[],
        Values::Notes(list) | Values::Only(list) => &[("", list)],
        Values::Bits(list) => &[("bit ", list)],
        Values::Flagged(list, flags) => &[("", list), ("plus bit ", flags)],
        Values::Keys(keys, read) => &[("written ", keys), ("read ", read)],
    };
    let line = |(prefix, list): &(&str, &[Choice])| {
        list.iter().map(|choice| format!("<br>{prefix}{}", choice_text(choice))).collect::<String>()
    };
    description.to_owned() + &lists.iter().map(line).collect::<String>()
}

fn choice_text(choice: &Choice) -> String {
    let Choice { first, last, text } = choice;
    if first == last { format!("{first}: {text}") } else { format!("{first} to {last}: {text}") }
}
