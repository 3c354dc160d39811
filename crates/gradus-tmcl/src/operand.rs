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

numbers! {
    /// What command 142 does (RAMDEBUG of PyTrinamic).
    CaptureAction {
        /// Forgets everything that was set.
        INIT = 0,
        /// Samples of all channels together.
        SET_LENGTH = 1,
        /// Ignored.
        SET_SAMPLING_SOURCE = 2,
        /// Base periods that are left out between two samples.
        SET_PRESCALER = 3,
        /// One more channel; the motor field is a [`CaptureSource`].
        SET_CHANNEL = 4,
        /// What the trigger looks at, as for a channel.
        SET_TRIGGER_CHANNEL = 5,
        /// Bits that the trigger looks at: the mask, and in the motor field how far it is shifted.
        SET_SHIFT_MASK = 6,
        /// Starts; the motor field is a [`CaptureTrigger`], the value its threshold.
        ENABLE_TRIGGER = 7,
        /// Answers a [`CaptureState`].
        GET_STATE = 8,
        /// Answers the sample of that index.
        GET_SAMPLE = 9,
        /// Answers a [`CaptureInfo`].
        GET_INFO = 10,
        /// Answers the source of the channel in the motor field.
        GET_CHANNEL_TYPE = 11,
        /// Answers what the channel in the motor field selects.
        GET_CHANNEL_ADDRESS = 12,
        /// Samples of all channels together from before the trigger.
        SET_PRETRIGGER = 13,
        /// Answers them.
        GET_PRETRIGGER = 14,
        /// Answers how many samples from that index on follow as raw bytes, see [`Bulk`](crate::Bulk).
        BULK_DOWNLOAD = 22,
    }
}

numbers! {
    /// What a channel of a capture samples.
    CaptureSource {
        /// Nothing.
        DISABLED = 0,
        /// An axis parameter: axis << 24 | number.
        AXIS_PARAMETER = 1,
        /// Milliseconds since power-on.
        TIME = 4,
        /// An analogue input.
        ANALOG_INPUT = 6,
        /// A global parameter: bank << 24 | number.
        GLOBAL_PARAMETER = 8,
    }
}

numbers! {
    /// What starts a capture.
    CaptureTrigger {
        /// The command.
        UNCONDITIONAL = 0,
        /// A signed value comes to the threshold from below.
        RISING_SIGNED = 1,
        /// A signed value comes to the threshold from above.
        FALLING_SIGNED = 2,
        /// Either.
        BOTH_SIGNED = 3,
        /// An unsigned value comes to the threshold from below.
        RISING_UNSIGNED = 4,
        /// An unsigned value comes to the threshold from above.
        FALLING_UNSIGNED = 5,
        /// Either.
        BOTH_UNSIGNED = 6,
    }
}

numbers! {
    /// How far a capture has come.
    CaptureState {
        /// Nothing has been started.
        IDLE = 0,
        /// It waits for its trigger.
        TRIGGER = 1,
        /// It samples.
        CAPTURE = 2,
        /// All samples are there.
        COMPLETE = 3,
        /// It samples what shall be there when the trigger comes.
        PRETRIGGER = 4,
    }
}

numbers! {
    /// What can be asked about captures.
    CaptureInfo {
        /// Largest number of channels.
        CHANNELS = 0,
        /// Largest number of samples, all channels together.
        SAMPLES = 1,
        /// Base rate in Hz.
        BASE_RATE = 2,
        /// Samples that can be read now.
        CAPTURED = 3,
    }
}
