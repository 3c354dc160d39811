//! Spans of time as they are typed: `60s`, `500ms`, `2m`, `1h`.

use std::time::Duration;

const UNITS: [(&str, f64); 4] = [("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("h", 3600.0)];

/// Reads a span of time.
///
/// # Errors
/// Says what is wrong with it.
pub fn parse(text: &str) -> Result<Duration, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = UNITS.iter().find(|(unit, _)| *unit == &text[digits.len()..]);
    let seconds = unit.zip(digits.parse::<f64>().ok()).map(|((_, factor), number)| number * factor);
    let span = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    span.ok_or_else(|| "a number with a unit is expected: 500ms, 60s, 2m, 1h".into())
}

/// Reads a span of time that is not zero.
///
/// # Errors
/// Says what is wrong with it.
pub fn parse_period(text: &str) -> Result<Duration, String> {
    let span = parse(text)?;
    if span.is_zero() { Err("a time longer than 0 is expected".into()) } else { Ok(span) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_span_is_a_number_with_a_unit() {
        let cases = [("60s", 60_000), ("500ms", 500), ("2m", 120_000), ("1h", 3_600_000), ("1.5s", 1500), ("0s", 0)];
        for (text, ms) in cases {
            assert_eq!(parse(text), Ok(Duration::from_millis(ms)), "{text}");
        }
    }

    #[test]
    fn a_period_is_longer_than_nothing() {
        assert_eq!(parse_period("1ms"), Ok(Duration::from_millis(1)));
        assert_eq!(parse_period("0ms"), Err("a time longer than 0 is expected".into()));
    }

    #[test]
    fn anything_else_is_refused() {
        for text in ["60", "s", "", "-1s", "1d", "1 s", "1e400s", "nans"] {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
