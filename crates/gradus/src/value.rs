//! Values as they are typed: `1000`, `0x100`, `50%`, `100rpm`, `51.2mm/s`, `500mA`.

use anyhow::{Context, bail};
use gradus_host::{Named, Session};

use crate::cmd::units;

/// The value of a parameter: a number, also to the bases 16 (`0x`, `$`) and 2 (`0b`), a percentage of its largest value, or a
/// quantity with a unit. `travel` is in mm a turn of the motor.
///
/// # Errors
/// When it is none of these, or beyond the range.
pub fn parse(text: &str, named: &Named, session: &mut Session, axis: u8, travel: Option<f64>) -> anyhow::Result<i64> {
    let text = text.trim();
    if let Some(number) = number(text) {
        return Ok(number);
    }
    if let Some(percent) = text.strip_suffix('%') {
        let percent: f64 = percent.trim().parse().with_context(|| format!("`{text}` is no percentage"))?;
        return part(named, percent).with_context(|| format!("{named} takes {}, not {text}", named.range()));
    }
    let own = named.unit().text();
    if let Some(number) = text.strip_suffix(own).filter(|_| !own.is_empty()).and_then(|text| number(text.trim())) {
        return Ok(number);
    }
    match units::setting(text, named.unit(), session, axis, travel)? {
        Some(setting) => Ok(setting),
        None if own.is_empty() => bail!("{named} takes a number without a unit, not `{text}`: {}", named.range()),
        None => bail!("{named} takes a number in {own}, not `{text}`: {}", named.range()),
    }
}

/// A whole number, to base 10, 16 or 2, with a sign.
pub fn number(text: &str) -> Option<i64> {
    let (sign, digits) = text.strip_prefix('-').map_or((1, text), |digits| (-1, digits));
    let based = |prefixes: [&str; 2]| prefixes.iter().find_map(|prefix| digits.strip_prefix(prefix));
    let (digits, base) = match (based(["0x", "$"]).or(based(["0X", "0X"])), based(["0b", "0B"])) {
        (Some(digits), _) => (digits, 16),
        (None, Some(digits)) => (digits, 2),
        (None, None) => (digits, 10),
    };
    let plain = digits.starts_with(|c: char| c.is_ascii_hexdigit());
    i64::from_str_radix(digits, base).ok().filter(|_| plain).map(|value| sign * value)
}

/// A percentage of the largest value; below 0 of the smallest one.
fn part(named: &Named, percent: f64) -> Option<i64> {
    let (min, max) = named.limits();
    let end = if percent < 0.0 { -min } else { max };
    let value = (end as f64 * percent / 100.0).round() as i64;
    (min..=max).contains(&value).then_some(value)
}

#[cfg(test)]
mod tests {
    use gradus_host::find;
    use gradus_sim::Bench;
    use gradus_tmcl::catalogue::Module;

    use super::*;

    fn value(module: &str, name: &str, text: &str) -> anyhow::Result<i64> {
        let module = Module::named(module).unwrap();
        let mut session = Session::on_bench(Bench::rigid(module)).unwrap();
        parse(text, &find(module, name).unwrap(), &mut session, 0, Some(5.0))
    }

    #[test]
    fn numbers_have_bases_percentages_and_units() {
        let cases = [
            ("tmcm-3351", "max_speed", "1000", 1000),
            ("tmcm-3351", "target_speed", "-0x100", -256),
            ("tmcm-3351", "target_speed", "$ff", 255),
            ("tmcm-3351", "max_speed", "0b101", 5),
            ("tmcm-3351", "maximum_current", "50%", 128),
            ("tmcm-3351", "target_speed", "-100%", -16_777_215),
            ("tmcm-3351", "max_speed", "60rpm", 51_200),
            ("tmcm-3351", "max_speed", "2000pps", 2000),
            ("tmcm-3351", "max_speed", "51.2mm/s", 524_288),
            ("tmcm-3351", "target_position", "-1.5turns", -76_800),
            ("tmcm-3351", "max_acceleration", "1rps2", 51_200),
            ("tmcm-1617", "maximum_current", "1500mA", 1500),
            ("tmcm-1617", "target_velocity", "2rps", 120),
        ];
        for (module, name, text, expected) in cases {
            assert_eq!(value(module, name, text).unwrap(), expected, "{name} {text}");
        }
    }

    #[test]
    fn what_is_no_value_gets_a_reason() {
        let cases = [
            ("maximum_current", "5V", "takes a number without a unit, not `5V`: 0 to 255"),
            ("maximum_current", "101%", "takes 0 to 255, not 101%"),
            ("max_speed", "3furlongs", "`furlongs` is no unit of speed here, but pps, rps, rpm, mm/s"),
            ("max_speed", "fast", "`fast` is no number with a unit"),
            ("max_speed", "0x", "is no unit of speed here"),
        ];
        for (name, text, expected) in cases {
            let error = format!("{:#}", value("tmcm-3351", name, text).unwrap_err());
            assert!(error.contains(expected), "{error}");
        }
    }
}
