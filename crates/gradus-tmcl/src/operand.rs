//! Names for the numbers of type fields.
//!
//! The firmware matches on these; the keywords of the assembly language are in `catalogue::COMMANDS`.

macro_rules! numbers {
    ($(#[$doc:meta])* $name:ident { $($(#[$item:meta])* $constant:ident = $number:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, Debug)]
        pub struct $name(pub u8);
        impl $name { $($(#[$item])* pub const $constant: Self = Self($number);)* }
    };
}

numbers! {
    /// What CALC and its relatives do with two operands.
    Operation {
        /// Sum.
        ADD = 0,
        /// Difference.
        SUB = 1,
        /// Product.
        MUL = 2,
        /// Quotient, rounded toward zero.
        DIV = 3,
        /// Remainder.
        MOD = 4,
        /// Bitwise and.
        AND = 5,
        /// Bitwise or.
        OR = 6,
        /// Bitwise exclusive or.
        XOR = 7,
        /// Bitwise complement.
        NOT = 8,
        /// Copy.
        LOAD = 9,
        /// Exchange.
        SWAP = 10,
        /// Comparison.
        COMP = 11,
    }
}

numbers! {
    /// What MVP moves to.
    MoveKind {
        /// A position.
        ABS = 0,
        /// A distance.
        REL = 1,
        /// A stored coordinate.
        COORD = 2,
    }
}

numbers! {
    /// What WAIT waits for.
    WaitFor {
        /// A time.
        TICKS = 0,
        /// The target position.
        POS = 1,
        /// The reference switch.
        REFSW = 2,
        /// A limit switch.
        LIMSW = 3,
        /// The end of a reference search.
        RFS = 4,
    }
}

numbers! {
    /// What RFS does.
    Search {
        /// Starts a reference search.
        START = 0,
        /// Stops it.
        STOP = 1,
        /// Asks for its state.
        STATUS = 2,
    }
}
