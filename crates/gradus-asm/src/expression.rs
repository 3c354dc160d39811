//! Expressions: `+ - * / ^ ( )`, functions, numbers, constants and labels.
//!
//! An expression is kept as a list of steps for a stack machine, so that neither its evaluation nor its removal needs
//! recursion, however long the line is. Values are floating point; a command rounds what it uses.
//!
//! `^` binds strongest and to the right, then the signs, then `* /`, then `+ -`: `-2^2` is -4, `2^-1` is 0.5.

use crate::code::Code;
use crate::lexer::{Kind, Token};
use crate::problem::{Problem, Span};

/// How deep brackets, signs and powers may be nested.
const MAX_DEPTH: usize = 100;

/// A function of one argument. Angles are in radians, RAD turns degrees into radians and DEG radians into degrees.
struct Function {
    name: &'static str,
    apply: fn(f64) -> f64,
}

const fn function(name: &'static str, apply: fn(f64) -> f64) -> Function {
    Function { name, apply }
}

#[rustfmt::skip]
const FUNCTIONS: &[Function] = &[
    function("SIN", f64::sin),
    function("COS", f64::cos),
    function("TAN", f64::tan),
    function("ASIN", f64::asin),
    function("ACOS", f64::acos),
    function("ATAN", f64::atan),
    function("LOG", f64::log10),
    function("LN", f64::ln),
    function("EXP", f64::exp),
    function("SQRT", f64::sqrt),
    function("ABS", f64::abs),
    function("INT", f64::trunc),
    function("ROUND", f64::round),
    function("SIGN", |x| if x == 0.0 { 0.0 } else { x.signum() }),
    function("DEG", f64::to_degrees),
    function("RAD", f64::to_radians),
];

/// True for the name of a function, in any case.
pub(crate) fn is_function(name: &str) -> bool {
    functions().any(|function| function.eq_ignore_ascii_case(name))
}

/// Names of the functions.
pub fn functions() -> impl Iterator<Item = &'static str> {
    FUNCTIONS.iter().map(|function| function.name)
}

enum Action {
    Number(f64),
    Name(String),
    Negate,
    Operate(char),
    Call(&'static Function),
}

struct Step {
    action: Action,
    /// The part of the expression whose value this step gives.
    span: Span,
}

/// An expression; without steps if it was malformed, which has been reported then.
pub(crate) struct Expression {
    steps: Vec<Step>,
    pub span: Span,
}

/// Why an expression has no value.
#[derive(Debug, PartialEq)]
pub(crate) enum Fault {
    /// It has been reported where it was found.
    Reported,
    /// No such name.
    Unknown(String, Span),
    /// This part has no finite value.
    Arithmetic(Span),
    /// This part is a division by zero.
    DivisionByZero(Span),
}

/// What a name stands for.
pub(crate) enum Meaning {
    Value(f64),
    /// Its definition is wrong and reported.
    Failed,
    Unknown,
}

impl Expression {
    /// In place of one that was malformed.
    pub fn broken(span: Span) -> Self {
        Self { steps: Vec::new(), span }
    }

    /// True if it was malformed.
    pub fn is_broken(&self) -> bool {
        self.steps.is_empty()
    }

    /// Reads all the tokens as one expression; `span` is the place where it should stand.
    pub fn parse(tokens: &[Token], span: Span) -> Result<Self, Problem> {
        let mut parser = Parser { tokens, at: 0, depth: 0, end: span, steps: Vec::new() };
        let span = parser.sum()?;
        parser.finish()?;
        Ok(Self { steps: parser.steps, span })
    }

    /// The name if the expression is nothing else.
    pub fn as_name(&self) -> Option<&str> {
        match self.steps.as_slice() {
            [Step { action: Action::Name(name), .. }] => Some(name),
            _ => None,
        }
    }

    /// The names in it, each with its place.
    pub fn names(&self) -> impl Iterator<Item = (&str, Span)> {
        self.steps.iter().filter_map(|step| match &step.action {
            Action::Name(name) => Some((name.as_str(), step.span)),
            _ => None,
        })
    }

    /// Its value, always finite.
    pub fn evaluate(&self, meaning: impl Fn(&str) -> Meaning) -> Result<f64, Fault> {
        let mut stack = Vec::new();
        for step in &self.steps {
            let value = step.perform(&mut stack, &meaning)?;
            if !value.is_finite() {
                return Err(Fault::Arithmetic(step.span));
            }
            stack.push(value);
        }
        stack.pop().ok_or(Fault::Reported)
    }
}

impl Step {
    fn perform(&self, stack: &mut Vec<f64>, meaning: impl Fn(&str) -> Meaning) -> Result<f64, Fault> {
        let mut pop = || stack.pop().ok_or(Fault::Reported);
        match &self.action {
            Action::Number(value) => Ok(*value),
            Action::Name(name) => match meaning(name) {
                Meaning::Value(value) => Ok(value),
                Meaning::Failed => Err(Fault::Reported),
                Meaning::Unknown => Err(Fault::Unknown(name.clone(), self.span)),
            },
            Action::Negate => Ok(-pop()?),
            Action::Call(function) => Ok((function.apply)(pop()?)),
            Action::Operate(sign) => match (pop()?, pop()?) {
                (0.0, _) if *sign == '/' => Err(Fault::DivisionByZero(self.span)),
                (right, left) => Ok(operate(*sign, left, right)),
            },
        }
    }
}

fn operate(sign: char, left: f64, right: f64) -> f64 {
    match sign {
        '+' => left + right,
        '-' => left - right,
        '*' => left * right,
        '/' => left / right,
        _ => left.powf(right),
    }
}

struct Parser<'a> {
    tokens: &'a [Token<'a>],
    at: usize,
    depth: usize,
    /// Where to point when the line ends too early.
    end: Span,
    steps: Vec<Step>,
}

impl<'a> Parser<'a> {
    fn peek(&self) -> Option<Token<'a>> {
        self.tokens.get(self.at).copied()
    }

    /// Takes the next token if it is one of these signs.
    fn sign(&mut self, signs: &str) -> Option<(char, Span)> {
        match self.peek()? {
            Token { kind: Kind::Sign(sign), span, .. } if signs.contains(sign) => {
                self.at += 1;
                Some((sign, span))
            }
            _ => None,
        }
    }

    fn push(&mut self, action: Action, span: Span) -> Span {
        self.steps.push(Step { action, span });
        span
    }

    fn sum(&mut self) -> Result<Span, Problem> {
        self.chain("+-", Self::product)
    }

    fn product(&mut self) -> Result<Span, Problem> {
        self.chain("*/", Self::signed)
    }

    /// Operands joined by signs of the same rank, from left to right.
    fn chain(&mut self, signs: &str, operand: fn(&mut Self) -> Result<Span, Problem>) -> Result<Span, Problem> {
        let mut span = operand(self)?;
        while let Some((sign, _)) = self.sign(signs) {
            let right = operand(self)?;
            span = self.push(Action::Operate(sign), span.to(right));
        }
        Ok(span)
    }

    fn signed(&mut self) -> Result<Span, Problem> {
        match self.sign("+-") {
            None => self.power(),
            Some((sign, start)) => {
                let operand = self.nested(start, Self::signed)?;
                let span = start.to(operand);
                Ok(if sign == '-' { self.push(Action::Negate, span) } else { span })
            }
        }
    }

    fn power(&mut self) -> Result<Span, Problem> {
        let base = self.atom()?;
        let Some((sign, at)) = self.sign("^") else { return Ok(base) };
        let exponent = self.nested(at, Self::signed)?;
        Ok(self.push(Action::Operate(sign), base.to(exponent)))
    }

    fn atom(&mut self) -> Result<Span, Problem> {
        let Some(token) = self.peek() else { return Err(self.missing()) };
        self.at += 1;
        match token.kind {
            Kind::Number(value) => Ok(self.push(Action::Number(value), token.span)),
            Kind::Name(name) => match self.sign("(") {
                Some((_, open)) => self.call(name, token.span, open),
                None => Ok(self.push(Action::Name(name.to_owned()), token.span)),
            },
            Kind::Sign('(') => self.brackets(token.span),
            Kind::BadNumber => Err(bad_number(&token)),
            Kind::Sign(_) => Err(unexpected(&token)),
        }
    }

    fn call(&mut self, name: &str, span: Span, open: Span) -> Result<Span, Problem> {
        let function = FUNCTIONS.iter().find(|function| function.name.eq_ignore_ascii_case(name));
        let Some(function) = function else {
            let problem = Problem::error(Code::UnknownName, span, format!("no function named `{name}`"));
            return Err(problem.maybe_help(crate::nearest::hint(name, functions())));
        };
        let end = self.brackets(open)?;
        Ok(self.push(Action::Call(function), span.to(end)))
    }

    /// What stands between brackets, the first of which has been read.
    fn brackets(&mut self, open: Span) -> Result<Span, Problem> {
        self.nested(open, Self::sum)?;
        match (self.sign(")"), self.peek()) {
            (Some((_, close)), _) => Ok(open.to(close)),
            (None, Some(token)) => Err(unexpected(&token)),
            (None, None) => Err(Problem::error(Code::Syntax, open, "this bracket is not closed")),
        }
    }

    fn nested(&mut self, at: Span, part: fn(&mut Self) -> Result<Span, Problem>) -> Result<Span, Problem> {
        if self.depth == MAX_DEPTH {
            return Err(Problem::error(Code::Syntax, at, "the expression is nested too deeply"));
        }
        self.depth += 1;
        let span = part(self);
        self.depth -= 1;
        span
    }

    fn missing(&self) -> Problem {
        let at = self.tokens.last().map_or(self.end, |last| last.span);
        Problem::error(Code::Syntax, at, "a number or name is missing here")
    }

    fn finish(&self) -> Result<(), Problem> {
        match self.peek() {
            None => Ok(()),
            Some(token) => Err(match token.kind {
                Kind::BadNumber => bad_number(&token),
                Kind::Sign(_) => unexpected(&token),
                _ => unexpected(&token).help("operands are separated by commas"),
            }),
        }
    }
}

/// A token that cannot stand where it does.
pub(crate) fn unexpected(token: &Token) -> Problem {
    Problem::error(Code::Syntax, token.span, format!("`{}` cannot stand here", token.text))
}

fn bad_number(token: &Token) -> Problem {
    Problem::error(Code::Syntax, token.span, format!("`{}` is not a number", token.text))
        .help("numbers are written as 42, 2.5, $2A, 0x2A, %101010 or 0b101010")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lexer::tokens;

    fn parse(text: &str) -> Result<Expression, Problem> {
        let span = Span { source: 0, start: 0, end: text.len() };
        Expression::parse(&tokens(text, span), span)
    }

    fn evaluate(text: &str) -> String {
        let name = |name: &str| match name {
            "five" => Meaning::Value(5.0),
            "failed" => Meaning::Failed,
            _ => Meaning::Unknown,
        };
        let part = |span: Span| text[span.start..span.end].to_owned();
        match parse(text).map(|expression| expression.evaluate(name)) {
            Ok(Ok(value)) => format!("{}", (value * 1e6).round() / 1e6 + 0.0),
            Ok(Err(Fault::Reported)) => "reported".into(),
            Ok(Err(Fault::Unknown(name, _))) => format!("unknown {name}"),
            Ok(Err(Fault::DivisionByZero(span))) => format!("by zero: {}", part(span)),
            Ok(Err(Fault::Arithmetic(span))) => format!("no value: {}", part(span)),
            Err(problem) => format!("{} at {}", problem.message, part(problem.span)),
        }
    }

    #[test]
    fn operators_have_the_usual_ranks() {
        for (text, value) in [
            ("1 + 2 * 3", "7"),
            ("(1 + 2) * 3", "9"),
            ("10 - 4 - 3", "3"),
            ("64 / 4 / 2", "8"),
            ("7 / 2", "3.5"),
            ("2 ^ 3 ^ 2", "512"),
            ("-2 ^ 2", "-4"),
            ("(-2) ^ 2", "4"),
            ("2 ^ -1", "0.5"),
            ("2 ^ 0.5 * 2", "2.828427"),
            ("2 * -3", "-6"),
            ("- 10000", "-10000"),
            ("- - + 4", "4"),
            ("3 - -2", "5"),
            ("five * $10 + %11", "83"),
            ("1.5 + .25", "1.75"),
        ] {
            assert_eq!(evaluate(text), value, "{text}");
        }
    }

    #[test]
    fn functions_take_angles_in_radians() {
        for (text, value) in [
            ("sin(RAD(30))", "0.5"),
            ("COS(0)", "1"),
            ("TAN(RAD(45))", "1"),
            ("ASIN(1) * 2", "3.141593"),
            ("ACOS(-1)", "3.141593"),
            ("ATAN(1) * 4", "3.141593"),
            ("LOG(1000)", "3"),
            ("LN(EXP(2))", "2"),
            ("SQRT(2)", "1.414214"),
            ("ABS(-3)", "3"),
            ("INT(2.9)", "2"),
            ("INT(-2.9)", "-2"),
            ("ROUND(2.5)", "3"),
            ("ROUND(-2.5)", "-3"),
            ("SIGN(-8) + SIGN(0) + SIGN(8)", "0"),
            ("DEG(RAD(90))", "90"),
            ("Sqrt(3 ^ 2 + 4 ^ 2)", "5"),
        ] {
            assert_eq!(evaluate(text), value, "{text}");
        }
    }

    #[test]
    fn what_has_no_value_is_pointed_at() {
        for (text, fault) in [
            ("1 + 4 / 0", "by zero: 4 / 0"),
            ("4 / (five - 5)", "by zero: 4 / (five - 5)"),
            ("2 * SQRT(-1)", "no value: SQRT(-1)"),
            ("LOG(0)", "no value: LOG(0)"),
            ("10 ^ 400 - 1", "no value: 10 ^ 400"),
            ("0 ^ -1", "no value: 0 ^ -1"),
            ("five + six", "unknown six"),
            ("failed + six", "reported"),
        ] {
            assert_eq!(evaluate(text), fault, "{text}");
        }
    }

    #[test]
    fn malformed_expressions_are_pointed_at() {
        for (text, message) in [
            ("1 +", "a number or name is missing here at +"),
            ("* 2", "`*` cannot stand here at *"),
            ("(1 + 2", "this bracket is not closed at ("),
            ("1 + 2)", "`)` cannot stand here at )"),
            ("1 2", "`2` cannot stand here at 2"),
            ("SQR(2)", "no function named `SQR` at SQR"),
            ("SIN()", "`)` cannot stand here at )"),
            ("1 + 0xG", "`0xG` is not a number at 0xG"),
            ("1 § 2", "`§` cannot stand here at §"),
        ] {
            assert_eq!(evaluate(text), message, "{text}");
        }
    }

    #[test]
    fn depth_is_limited_and_length_is_not() {
        let nested = format!("{}1{}", "(".repeat(5000), ")".repeat(5000));
        assert_eq!(evaluate(&nested), "the expression is nested too deeply at (");
        assert!(evaluate(&"-".repeat(5000)).starts_with("the expression is nested too deeply"));
        assert_eq!(evaluate(&format!("1{}", " + 1".repeat(100_000))), "100001");
    }
}
