//! What the terminal can do: colours, and drawing over what was drawn before.

use std::env;
use std::io::{self, IsTerminal};
use std::sync::OnceLock;

use clap::ValueEnum;

/// When to use colours.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, ValueEnum)]
pub enum Color {
    /// On a terminal, unless NO_COLOR is set or TERM is dumb.
    #[default]
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

static CHOICE: OnceLock<Color> = OnceLock::new();

impl Color {
    /// What a command line says, before it is understood: messages about it are coloured too.
    pub fn of(arguments: impl Iterator<Item = String>) -> Self {
        let arguments: Vec<String> = arguments.collect();
        let behind = arguments.windows(2).filter(|pair| pair[0] == "--color").map(|pair| pair[1].as_str());
        let joined = arguments.iter().filter_map(|argument| argument.strip_prefix("--color="));
        behind.chain(joined).find_map(|text| Self::from_str(text, true).ok()).unwrap_or_default()
    }

    /// Lets this be the choice, here and for the parser of the command line.
    pub fn choose(self) -> clap::ColorChoice {
        let choice = *CHOICE.get_or_init(|| self);
        if colored(choice, io::stderr().is_terminal()) { clap::ColorChoice::Always } else { clap::ColorChoice::Never }
    }
}

/// True if messages for people have colours.
pub fn colored_messages() -> bool {
    colored(CHOICE.get().copied().unwrap_or_default(), io::stderr().is_terminal())
}

/// True if what is printed has colours.
pub fn colored_output() -> bool {
    colored(CHOICE.get().copied().unwrap_or_default(), io::stdout().is_terminal())
}

/// True if the standard output is a terminal on which a table can be drawn again and again.
pub fn is_live() -> bool {
    io::stdout().is_terminal() && !is_dumb()
}

/// True if a bar can be drawn on the standard error output.
pub fn has_bars() -> bool {
    io::stderr().is_terminal() && !is_dumb()
}

/// Characters in a line of the standard output; `None` where it is no terminal.
pub fn width() -> Option<usize> {
    #[cfg(unix)]
    if io::stdout().is_terminal() {
        let size = rustix::termios::tcgetwinsize(io::stdout()).ok()?;
        return Some(usize::from(size.ws_col)).filter(|columns| *columns > 0);
    }
    None
}

fn colored(choice: Color, is_terminal: bool) -> bool {
    match choice {
        Color::Always => true,
        Color::Never => false,
        Color::Auto => is_terminal && !is_dumb() && env::var_os("NO_COLOR").is_none_or(|value| value.is_empty()),
    }
}

fn is_dumb() -> bool {
    env::var_os("TERM").is_some_and(|term| term == "dumb")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_choice_is_read_before_the_command_line_is_understood() {
        for (line, expected) in [
            ("get --color never x", Color::Never),
            ("get --color=always", Color::Always),
            ("get --colour", Color::Auto),
            ("get --color", Color::Auto),
            ("get --color=red", Color::Auto),
        ] {
            assert_eq!(Color::of(line.split(' ').map(String::from)), expected, "{line}");
        }
    }

    #[test]
    fn without_a_terminal_colours_come_only_when_asked_for() {
        let cases = [(Color::Auto, false), (Color::Never, false), (Color::Always, true)];
        assert!(cases.iter().all(|(choice, expected)| colored(*choice, false) == *expected));
    }
}
