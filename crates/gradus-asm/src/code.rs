//! The kinds of problems. Their names stay the same from version to version.

macro_rules! codes {
    ($($(#[$doc:meta])* $code:ident = $text:literal,)*) => {
        /// What kind of problem it is. The names stay the same from version to version.
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
        pub enum Code { $($(#[$doc])* $code,)* }

        impl Code {
            /// Every code, those of the assembler first.
            pub const ALL: &[Code] = &[$(Self::$code,)*];

            /// As it is printed and as other tools see it.
            pub fn text(self) -> &'static str {
                match self { $(Self::$code => $text,)* }
            }

            /// The page that explains it, in Markdown: what it does, why it is bad, an example, how to allow it.
            pub fn page(self) -> &'static str {
                match self { $(Self::$code => include_str!(concat!("lint/explain/", $text, ".md")),)* }
            }
        }
    };
}

codes! {
    // Of the assembler.
    /// The line or an expression is malformed.
    Syntax = "syntax",
    /// No module has a command of that name.
    UnknownCommand = "unknown-command",
    /// Other modules have this command.
    CommandNotAvailable = "command-not-available",
    /// Too few or too many operands.
    OperandCount = "operand-count",
    /// No label or constant of that name.
    UnknownName = "unknown-name",
    /// The keyword exists, but not for this command on this module.
    KeywordNotAvailable = "keyword-not-available",
    /// A label or constant is defined twice.
    Duplicate = "duplicate",
    /// A file is no text in UTF-8 or Windows-1252.
    Encoding = "encoding",
    /// An included file does not exist or cannot be read.
    Include = "include",
    /// A file includes itself, perhaps through others.
    IncludeCycle = "include-cycle",
    /// A constant is defined by itself, perhaps through others.
    ConstantCycle = "constant-cycle",
    /// An expression without a finite value.
    Arithmetic = "arithmetic",
    /// A value that its field or its parameter does not take.
    OutOfRange = "out-of-range",
    /// The module has no such axis, parameter, bank, port, interrupt or coordinate.
    NotOnModule = "not-on-module",
    /// A parameter or port that can only be read is written.
    ReadOnly = "read-only",
    /// A parameter without a place in the EEPROM is stored or restored.
    NotStored = "not-stored",
    /// A jump to an address without a command.
    JumpTarget = "jump-target",
    /// More commands than the module's memory holds.
    ProgramTooLong = "program-too-long",

    // The EEPROM.
    /// A loop writes the EEPROM on every pass.
    EepromInLoop = "eeprom-in-loop",
    /// The EEPROM is written at every start.
    EepromAtStart = "eeprom-at-start",
    /// A stored variable is overwritten at every start before anything reads it.
    StoredOverwritten = "stored-overwritten",

    // Comparisons and registers.
    /// Arithmetic has replaced a comparison before its condition.
    ComparisonLost = "comparison-lost",
    /// A routine changes the flags between a comparison and a condition.
    FlagsAfterCall = "flags-after-call",
    /// Nothing sets the flags before a condition.
    ConditionWithoutComparison = "condition-without-comparison",
    /// A condition that always or never holds.
    ConditionConstant = "condition-constant",
    /// A loop waits for one exact value of something that changes continuously.
    EqualOnContinuous = "equal-on-continuous",
    /// A setting is written with a value that only a comparison has left in the accumulator.
    ConstantWritten = "constant-written",
    /// A value is loaded and never used.
    LoadUnused = "load-unused",

    // The flow of the program.
    /// Commands that no way leads to.
    Unreachable = "unreachable",
    /// The program runs into a routine that it has not called.
    FallsIntoRoutine = "falls-into-routine",
    /// RSUB where no CSUB leads.
    RsubOutside = "rsub-outside",
    /// RETI where no interrupt leads.
    RetiOutside = "reti-outside",
    /// A called routine that reaches no RSUB.
    RoutineNeverReturns = "routine-never-returns",
    /// A jump out of a routine into the program that calls it.
    JumpOutOfRoutine = "jump-out-of-routine",
    /// Calls nest deeper than the stack.
    CallDepth = "call-depth",
    /// A routine calls itself, perhaps through others.
    Recursion = "recursion",
    /// A jump to the next command.
    JumpToNext = "jump-to-next",
    /// The last command falls through: the assembler appends a STOP.
    StopAppended = "stop-appended",

    // Interrupts.
    /// A way out of an interrupt handler without RETI.
    HandlerWithoutReti = "handler-without-reti",
    /// The program runs into an interrupt handler.
    FallsIntoHandler = "falls-into-handler",
    /// A WAIT without time-out in an interrupt handler.
    HandlerWaits = "handler-waits",
    /// EI and VECT do not belong together.
    InterruptNotEnabled = "interrupt-not-enabled",
    /// A timer interrupt without a period.
    TimerWithoutPeriod = "timer-without-period",

    // Motion and time.
    /// A time-out that nothing looks at.
    TimeoutNotChecked = "timeout-not-checked",
    /// A look for a time-out that cannot happen.
    TimeoutNever = "timeout-never",
    /// WAIT POS on an axis that turns at a velocity.
    WaitPosAfterVelocity = "wait-pos-after-velocity",
    /// Standstill is tested before the motor can have started.
    StandstillPolledEarly = "standstill-polled-early",
    /// The position counter is written while the axis moves.
    PositionWrittenWhileMoving = "position-written-while-moving",
    /// A target is replaced before it is reached.
    MoveOverwritten = "move-overwritten",
    /// A motion command while a reference search runs.
    SearchNotAwaited = "search-not-awaited",
    /// Absolute moves without a reference.
    NotReferenced = "not-referenced",
    /// Both stop switches of an axis are off.
    SwitchesLeftOff = "switches-left-off",
    /// A time in a comment that is not the time of its WAIT.
    TicksComment = "ticks-comment",

    // Names and style.
    /// A label that nothing uses.
    UnusedLabel = "unused-label",
    /// A constant that nothing uses.
    UnusedConstant = "unused-constant",
    /// A number that has a name in this program.
    NamedNumber = "named-number",
    /// One name written in two ways.
    NearDuplicateName = "near-duplicate-name",
    /// A command that the module's firmware does not have yet.
    NeedsFirmware = "needs-firmware",
    /// Little room is left in program memory.
    MemoryNearlyFull = "memory-nearly-full",
    /// A pragma that allows what does not occur.
    UnneededAllow = "unneeded-allow",
    /// A pragma that nobody knows.
    UnknownPragma = "unknown-pragma",
}

impl Code {
    /// The code of that name, in any case.
    pub fn named(name: &str) -> Option<Code> {
        Self::ALL.iter().find(|code| code.text().eq_ignore_ascii_case(name)).copied()
    }

    /// The page for people and for other tools: its examples are indented, without the fences whose words only a test reads.
    pub fn explanation(self) -> String {
        let (mut text, mut inside) = (String::new(), false);
        for line in self.page().lines() {
            if line.starts_with("```") {
                inside = !inside;
            } else {
                let indent = if inside && !line.is_empty() { "    " } else { "" };
                text.extend([indent, line, "\n"]);
            }
        }
        text
    }

    /// The code whose name is nearest to a misspelled one.
    pub fn nearest(name: &str) -> Option<Code> {
        crate::nearest::nearest(name, Self::ALL.iter().map(|code| code.text())).and_then(Self::named)
    }
}
