//! What goes wrong on a line: bytes and frames that are lost, flipped, doubled, late or torn apart.
//!
//! A [`Profile`] says how often, as shares of the telegrams (nine bytes, or a CAN frame) in each direction; dice with a seed say
//! which, so a run with faults can be had again. On a stream of bytes the share is spread over the bytes. On CAN a frame is lost
//! where a serial line has a byte flipped, lost or torn: the bus has a checksum that lets nothing else through.

use std::fmt;
use std::str::FromStr;

use gradus_tmcl::can::Frame;
use serde::Deserialize;

/// Bytes of a telegram.
const TELEGRAM: f64 = 9.0;

/// How often what goes wrong. Shares are from 0 to 1, of the telegrams.
#[derive(Clone, Copy, PartialEq, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a profile's name or a table such as { flipped = 0.001 }")]
pub struct Profile {
    /// One bit of a byte is another.
    #[serde(deserialize_with = "crate::quantity::share")]
    pub flipped: f64,
    /// A byte does not arrive.
    #[serde(deserialize_with = "crate::quantity::share")]
    pub lost: f64,
    /// A byte, or a CAN frame, arrives twice.
    #[serde(deserialize_with = "crate::quantity::share")]
    pub doubled: f64,
    /// The line pauses inside a telegram.
    #[serde(deserialize_with = "crate::quantity::share")]
    pub split: f64,
    /// A reply does not arrive.
    #[serde(deserialize_with = "crate::quantity::share")]
    pub lost_replies: f64,
    /// A reply is late, and all that come after it wait.
    #[serde(deserialize_with = "crate::quantity::share")]
    pub late: f64,
    /// The shortest and the longest delay, and pause, in milliseconds.
    pub delay_ms: (u32, u32),
}

/// The profiles that have a name.
pub const PROFILES: &[(&str, Profile)] = &[
    ("noisy-line", Profile { flipped: 0.0009, lost: 0.0001, ..NOTHING }),
    (
        "bad-usb-cable",
        Profile { lost: 0.002, doubled: 0.001, split: 0.01, lost_replies: 0.001, delay_ms: (1, 100), ..NOTHING },
    ),
    ("late-replies", Profile { late: 0.001, delay_ms: (20, 400), ..NOTHING }),
];

const NOTHING: Profile =
    Profile { flipped: 0.0, lost: 0.0, doubled: 0.0, split: 0.0, lost_replies: 0.0, late: 0.0, delay_ms: (0, 0) };

/// A profile that nobody knows.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("there is no profile `{name}`, only {}", PROFILES.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", "))]
pub struct ProfileError {
    name: String,
}

impl FromStr for Profile {
    type Err = ProfileError;

    fn from_str(name: &str) -> Result<Self, ProfileError> {
        let known = PROFILES.iter().find(|(known, _)| *known == name);
        known.map(|(_, profile)| *profile).ok_or_else(|| ProfileError { name: name.to_owned() })
    }
}

/// Numbers that look random and are the same for the same seed (SplitMix64).
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn roll(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// True in so large a share of the rolls.
    fn hits(&mut self, share: f64) -> bool {
        share > 0.0 && ((self.roll() >> 11) as f64) < share * (1_u64 << 53) as f64
    }

    fn delay_us(&mut self, (least_ms, most_ms): (u32, u32)) -> u64 {
        let span = u64::from(most_ms.saturating_sub(least_ms)) * 1000 + 1;
        u64::from(least_ms) * 1000 + self.roll() % span
    }
}

impl fmt::Debug for Dice {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_tuple("Dice").field(&self.0).finish()
    }
}

/// One direction of a line with its faults.
#[derive(Clone, Debug)]
pub(crate) struct Faulty {
    profile: Profile,
    dice: Dice,
    /// What is sent later does not arrive before this time, in microseconds.
    held_until_us: u64,
}

impl Faulty {
    /// Both directions of a host's line.
    pub(crate) fn both_ways(profile: Profile, seed: u64) -> [Self; 2] {
        let seed = seed.wrapping_mul(2);
        [Self::new(profile, seed), Self::new(profile, seed.wrapping_add(1))]
    }

    fn new(profile: Profile, seed: u64) -> Self {
        Self { profile, dice: Dice::new(seed), held_until_us: 0 }
    }

    /// Sends bytes at `now_us`; `arrive` gets each that arrives with its time.
    pub(crate) fn bytes(&mut self, now_us: u64, bytes: &[u8], mut arrive: impl FnMut(u64, u8)) {
        let Profile { lost, flipped, doubled, split, .. } = self.profile;
        for byte in bytes {
            let at_us = self.held_until_us.max(now_us);
            let [lost, flipped, doubled, split] =
                [lost, flipped, doubled, split].map(|share| self.dice.hits(share / TELEGRAM));
            let byte = if flipped { *byte ^ 1 << (self.dice.roll() % 8) } else { *byte };
            for _ in usize::from(lost)..1 + usize::from(doubled) {
                arrive(at_us, byte);
            }
            if split {
                self.hold(at_us);
            }
        }
    }

    /// Sends a reply at `now_us`, as [`bytes`](Self::bytes); it may also be late or lost as a whole.
    pub(crate) fn reply(&mut self, now_us: u64, bytes: &[u8], arrive: impl FnMut(u64, u8)) {
        if self.reply_arrives(now_us) {
            self.bytes(now_us, bytes, arrive);
        }
    }

    /// Sends a frame at `now_us`; `arrive` gets it, perhaps twice or not at all, with its time.
    pub(crate) fn frame(&mut self, now_us: u64, frame: Frame, mut arrive: impl FnMut(u64, Frame)) {
        let Profile { lost, flipped, split, doubled, .. } = self.profile;
        let (lost, doubled) = (self.dice.hits(lost + flipped + split), self.dice.hits(doubled));
        for _ in usize::from(lost)..1 + usize::from(doubled) {
            arrive(self.held_until_us.max(now_us), frame);
        }
    }

    /// Sends a frame of a module at `now_us`, as [`frame`](Self::frame); it may also be late.
    pub(crate) fn reply_frame(&mut self, now_us: u64, frame: Frame, arrive: impl FnMut(u64, Frame)) {
        if self.reply_arrives(now_us) {
            self.frame(now_us, frame, arrive);
        }
    }

    fn reply_arrives(&mut self, now_us: u64) -> bool {
        if self.dice.hits(self.profile.late) {
            self.hold(now_us);
        }
        !self.dice.hits(self.profile.lost_replies)
    }

    fn hold(&mut self, now_us: u64) {
        self.held_until_us = self.held_until_us.max(now_us.saturating_add(self.dice.delay_us(self.profile.delay_ms)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TELEGRAMS: usize = 100_000;

    /// What arrives of many telegrams of nine zeros: the bytes with their times.
    fn arrivals(profile: Profile) -> Vec<(u64, u8)> {
        let mut line = Faulty::new(profile, 1);
        let mut arrived = Vec::new();
        for telegram in 0..TELEGRAMS {
            line.reply(telegram as u64 * 1000, &[0; 9], |at_us, byte| arrived.push((at_us, byte)));
        }
        arrived
    }

    fn assert_share(count: usize, share: f64) {
        let found = count as f64 / TELEGRAMS as f64;
        assert!((found - share).abs() < 0.1 * share, "{found} instead of {share}");
    }

    #[test]
    fn line_without_faults_changes_nothing() {
        let arrived = arrivals(Profile::default());
        assert_eq!(arrived.len(), 9 * TELEGRAMS);
        assert!(arrived.iter().enumerate().all(|(index, arrival)| *arrival == (index as u64 / 9 * 1000, 0)));
    }

    #[test]
    fn share_is_one_of_telegrams() {
        let share = 0.02;
        let flipped = arrivals(Profile { flipped: share, ..NOTHING });
        assert_share(flipped.iter().filter(|(_, byte)| byte.count_ones() == 1).count(), share);
        assert!(flipped.iter().all(|(_, byte)| byte.count_ones() < 2));
        assert_share(9 * TELEGRAMS - arrivals(Profile { lost: share, ..NOTHING }).len(), share);
        assert_share(arrivals(Profile { doubled: share, ..NOTHING }).len() - 9 * TELEGRAMS, share);
        let replies = arrivals(Profile { lost_replies: share, ..NOTHING }).len();
        assert_share(TELEGRAMS - replies / 9, share);
    }

    #[test]
    fn late_and_split_telegrams_arrive_whole_and_in_order() {
        for profile in [Profile { late: 0.001, ..NOTHING }, Profile { split: 0.001, ..NOTHING }] {
            let arrived = arrivals(Profile { delay_ms: (20, 400), ..profile });
            assert_eq!(arrived.len(), 9 * TELEGRAMS);
            assert!(arrived.is_sorted_by_key(|(at_us, _)| *at_us));
            let delays = arrived.iter().enumerate().map(|(index, (at_us, _))| at_us - index as u64 / 9 * 1000);
            assert!((380_000..800_000).contains(&delays.max().unwrap()), "one pause may fall into another");
        }
    }

    #[test]
    fn same_seed_is_the_same_line() {
        let profile: Profile = "bad-usb-cable".parse().unwrap();
        assert_eq!(arrivals(profile), arrivals(profile));
    }

    #[test]
    fn noisy_line_garbles_one_telegram_in_a_thousand() {
        let Profile { flipped, lost, .. } = "noisy-line".parse().unwrap();
        assert!((flipped + lost - 0.001).abs() < 1e-12);
    }

    #[test]
    fn frames_are_lost_or_doubled_never_changed() {
        let mut line = Faulty::new(Profile { flipped: 0.01, doubled: 0.02, ..NOTHING }, 1);
        let sent = Frame::new(1, false, &[1; 7]).unwrap();
        let mut counts = [0; 3];
        for _ in 0..TELEGRAMS {
            let mut count = 0;
            line.frame(0, sent, |_, frame| {
                assert_eq!(frame, sent);
                count += 1;
            });
            counts[count] += 1;
        }
        assert_share(counts[0], 0.01 * 0.98);
        assert_share(counts[2], 0.02 * 0.99);
    }

    #[test]
    fn unknown_profile_is_told_which_there_are() {
        let error = "noisy".parse::<Profile>().unwrap_err();
        assert_eq!(error.to_string(), "there is no profile `noisy`, only noisy-line, bad-usb-cable, late-replies");
    }
}
