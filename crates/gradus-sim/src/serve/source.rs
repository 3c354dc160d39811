//! What a server waits for.

/// Somebody who may have something for the server.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Source {
    Stop,
    Console,
    Listener(usize),
    Visitors(usize),
    Line(usize),
}

impl Source {
    /// As the waiter keeps it.
    pub(crate) fn token(self) -> u64 {
        let (kind, index) = match self {
            Self::Stop => (0, 0),
            Self::Console => (1, 0),
            Self::Listener(index) => (2, index),
            Self::Visitors(index) => (3, index),
            Self::Line(index) => (4, index),
        };
        index as u64 * 5 + kind
    }

    pub(crate) fn of(token: u64) -> Self {
        let index = (token / 5) as usize;
        match token % 5 {
            0 => Self::Stop,
            1 => Self::Console,
            2 => Self::Listener(index),
            3 => Self::Visitors(index),
            _ => Self::Line(index),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_name_their_source() {
        for source in [Source::Stop, Source::Console, Source::Listener(7), Source::Visitors(0), Source::Line(19_999)] {
            assert_eq!(Source::of(source.token()), source);
        }
    }
}
