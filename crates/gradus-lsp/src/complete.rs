//! What may be written next.

use gradus_asm::{BUILT_IN, Code, Defined, PRAGMAS, functions};
use gradus_tmcl::catalogue::{Command, MODULES, Mode, Module, Operand, OperandKind};

use crate::analysis::Analysis;
use crate::context::{Context, context};
use crate::describe;

/// What kind of thing a proposal is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[allow(missing_docs)] // the variants say it
pub enum ProposalKind {
    Mnemonic,
    Keyword,
    Parameter,
    Port,
    Interrupt,
    Label,
    Constant,
    Function,
    File,
    Pragma,
    Snippet,
    Number,
}

/// Something that may be written at the cursor.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Proposal {
    /// As the list shows it.
    pub label: String,
    /// What kind it is.
    pub kind: ProposalKind,
    /// A few words beside the label.
    pub detail: String,
    /// More about it, in Markdown.
    pub text: String,
    /// What is written.
    pub insert: String,
    /// What typed letters are compared with.
    pub filter: String,
}

/// Proposals, and how many bytes before the cursor each replaces.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Proposals {
    /// The proposals, the likelier first.
    pub items: Vec<Proposal>,
    /// Bytes of the word that is being written.
    pub replaces: usize,
}

impl Proposal {
    fn new(label: impl Into<String>, kind: ProposalKind, detail: impl Into<String>) -> Self {
        let label = label.into();
        let (insert, filter) = (label.clone(), label.clone());
        Self { label, kind, detail: detail.into(), text: String::new(), insert, filter }
    }

    fn text(self, text: impl Into<String>) -> Self {
        Self { text: text.into(), ..self }
    }

    /// A number that is found by its name too.
    fn number(number: impl ToString, name: &str, kind: ProposalKind) -> Self {
        let number = number.to_string();
        Self {
            label: format!("{number}: {name}"),
            kind,
            detail: String::new(),
            text: String::new(),
            filter: format!("{number} {name}"),
            insert: number,
        }
    }
}

/// Returns what may be written at the end of `line`, which is the part of a line before the cursor.
pub fn complete(analysis: &Analysis, line: &str) -> Proposals {
    let module = analysis.module();
    let (items, word) = match context(line, module) {
        Context::Start { word } => (starts(module), word),
        Context::Operand { command, index, before, word } => (operands(analysis, command, index, &before), word),
        Context::Value { word } => (values(analysis), word),
        Context::Include { word } => {
            (BUILT_IN.iter().map(|name| Proposal::new(*name, ProposalKind::File, "built in")).collect(), word)
        }
        Context::Pragma { word } => (pragmas(), word),
        Context::Code { word } => (codes(), word),
        Context::Comment => (Vec::new(), ""),
    };
    Proposals { items, replaces: word.len() }
}

fn starts(module: &'static Module) -> Vec<Proposal> {
    let commands = gradus_tmcl::catalogue::COMMANDS.iter().filter(|row| in_programs(row, module));
    let mnemonics = commands
        .map(|row| Proposal::new(row.mnemonic, ProposalKind::Mnemonic, row.name).text(describe::command(row, module)));
    let include = Proposal::new("#include", ProposalKind::Keyword, "read another file here");
    mnemonics.chain([include]).chain(snippets()).collect()
}

fn in_programs(row: &Command, module: &Module) -> bool {
    !row.mnemonic.is_empty() && matches!(module.mode(row.opcode), Mode::Both | Mode::Standalone)
}

/// Pieces of programs with places to fill in.
fn snippets() -> impl Iterator<Item = Proposal> {
    SNIPPETS.iter().map(|(name, detail, text)| Proposal {
        insert: (*text).to_owned(),
        ..Proposal::new(*name, ProposalKind::Snippet, *detail)
    })
}

const SNIPPETS: &[(&str, &str, &str)] = &[
    (
        "homing",
        "search the home switch, give up after a time",
        "RFS START, ${1:0}\nWAIT RFS, ${1:0}, ${2:3000}\nJC ETO, ${3:NotFound}\n$0",
    ),
    (
        "state machine",
        "jump by a user variable",
        "${1:Loop}:\n    GGP ${2:0}, 2\n    COMP 1\n    JC EQ, ${3:First}\n    JA ${1:Loop}\n$0",
    ),
    (
        "handler",
        "an interrupt with its handler",
        "VECT ${1:3}, ${2:OnEvent}\nEI ${1:3}\nEI 255\n$0\n\n${2:OnEvent}:\n    RETI",
    ),
];

fn operands(analysis: &Analysis, command: &'static Command, index: usize, before: &[&str]) -> Vec<Proposal> {
    let Some(operand) = command.operands.get(index) else { return Vec::new() };
    let mut items = of_kind(analysis, command, operand, before);
    if operand.kind == OperandKind::Address {
        items.extend(names(analysis, false).filter(|item| item.kind == ProposalKind::Label));
    }
    if !matches!(operand.kind, OperandKind::Keyword(_) | OperandKind::Zero) {
        items.extend(values(analysis).into_iter().filter(|item| item.kind != ProposalKind::Label));
    }
    items
}

fn of_kind(analysis: &Analysis, command: &Command, operand: &Operand, before: &[&str]) -> Vec<Proposal> {
    let module = analysis.module();
    match operand.kind {
        OperandKind::Keyword(words) => {
            let has = words.iter().filter(|word| operand.keyword(word.text, module).is_some());
            has.map(|word| Proposal::new(word.text, ProposalKind::Keyword, format!("= {}", word.number))).collect()
        }
        OperandKind::AxisParameter => axis_parameters(analysis),
        OperandKind::GlobalParameter => global_parameters(module),
        OperandKind::Port => ports(module),
        OperandKind::Interrupt => interrupts(module),
        OperandKind::Axis | OperandKind::AxisOrMask | OperandKind::AxisOrEeprom => {
            (0..module.axes).map(|axis| Proposal::new(axis.to_string(), ProposalKind::Number, "axis")).collect()
        }
        OperandKind::ParameterBank => banks(before, module),
        OperandKind::Number if command.mnemonic.eq_ignore_ascii_case("SAP") => choices(before, module),
        _ => Vec::new(),
    }
}

/// Axis parameters by number, and by symbol where the program includes the names.
fn axis_parameters(analysis: &Analysis) -> Vec<Proposal> {
    let module = analysis.module();
    let rows = module.axis_parameters.iter();
    rows.map(|row| {
        let text = describe::axis_parameter(row, module);
        let proposal = Proposal::number(row.number, row.name, ProposalKind::Parameter).text(text);
        Proposal {
            detail: row.unit.text().to_owned(),
            filter: format!("{} {}", proposal.filter, row.symbol),
            ..proposal
        }
    })
    .collect()
}

fn global_parameters(module: &'static Module) -> Vec<Proposal> {
    let rows = module.global_parameters.iter();
    rows.map(|row| {
        let text = describe::global_parameter(row, row.first, module);
        let proposal = Proposal::number(row.first, row.name, ProposalKind::Parameter).text(text);
        Proposal { detail: format!("bank {}", row.bank), ..proposal }
    })
    .collect()
}

fn ports(module: &'static Module) -> Vec<Proposal> {
    let rows = module.ports.iter();
    rows.map(|row| Proposal {
        detail: format!("bank {}", row.bank),
        ..Proposal::number(row.number, row.name, ProposalKind::Port)
    })
    .collect()
}

fn interrupts(module: &'static Module) -> Vec<Proposal> {
    let rows = module.interrupts.iter();
    rows.map(|row| Proposal {
        detail: row.symbol.to_owned(),
        ..Proposal::number(row.number, row.name, ProposalKind::Interrupt)
    })
    .collect()
}

/// The banks that have a parameter of the number before.
fn banks(before: &[&str], module: &Module) -> Vec<Proposal> {
    let number = before.first().and_then(|text| text.parse::<u8>().ok());
    let has = |bank: &u8| number.is_none_or(|number| module.global_parameter(*bank, number).is_some());
    let name = |bank: u8| ["settings", "user area", "user variables", "interrupts"][usize::from(bank)];
    (0..4).filter(has).map(|bank| Proposal::number(bank, name(bank), ProposalKind::Number)).collect()
}

/// The listed values of the axis parameter that is set.
fn choices(before: &[&str], module: &Module) -> Vec<Proposal> {
    let row = before.first().and_then(|text| text.parse().ok()).and_then(|number| module.axis_parameter(number));
    let listed = row.map_or(&[][..], |row| row.values.choices());
    listed.iter().map(|choice| Proposal::number(choice.first, choice.text, ProposalKind::Number)).collect()
}

/// Names of the program and functions.
fn values(analysis: &Analysis) -> Vec<Proposal> {
    let mut functions: Vec<_> = functions().collect();
    functions.sort_unstable();
    let functions = functions.into_iter().map(|name| Proposal::new(name, ProposalKind::Function, "function"));
    names(analysis, true).chain(functions).collect()
}

fn names(analysis: &Analysis, with_constants: bool) -> impl Iterator<Item = Proposal> {
    analysis.definitions().filter_map(move |(_, of)| match of {
        Defined::Label(index) => {
            let label = analysis.label(index);
            Some(Proposal::new(&*label.name, ProposalKind::Label, format!("address {}", label.address)))
        }
        Defined::Constant(index) if with_constants => {
            let constant = analysis.constant(index);
            let detail = crate::symbols::value_text(constant.value);
            Some(Proposal::new(&*constant.name, ProposalKind::Constant, detail))
        }
        Defined::Constant(_) => None,
    })
}

fn pragmas() -> Vec<Proposal> {
    let modules = MODULES.iter().map(|module| format!("module {}", module.name.to_lowercase()));
    let words = PRAGMAS.iter().filter(|word| **word != "module").map(|word| (*word).to_owned());
    words.chain(modules).map(|word| Proposal::new(word, ProposalKind::Pragma, "")).collect()
}

fn codes() -> Vec<Proposal> {
    Code::ALL.iter().map(|code| Proposal::new(code.text(), ProposalKind::Keyword, "")).collect()
}
