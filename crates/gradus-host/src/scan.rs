//! Finding modules: on serial ports at all rates, at all addresses, on CAN buses at all identifiers (behind
//! a serial adapter at all bit rates).
//!
//! A [`plan`] asks for a module as it is delivered first, at every rate: that takes about a second. Then comes the rest.
//!
//! Each place is asked one harmless question (the probe by which a session gets in step), so that nothing of a module is changed.
//! At a wrong baud rate a module hears noise, which its address and its checksum let pass hardly ever. One whose replies are
//! suppressed is not found.

use std::ops::RangeInclusive;
use std::time::Duration;

use gradus_tmcl::Opcode;
use gradus_tmcl::catalogue::Gp;

use crate::serial::SerialStream;
use crate::{Address, Bus, Error, Line, Place, Session, Url};

/// Baud rates of the modules, the usual ones first.
pub const BAUD_RATES: [u32; 12] =
    [9600, 115_200, 19_200, 38_400, 57_600, 14_400, 28_800, 76_800, 230_400, 250_000, 500_000, 1_000_000];

/// Bit rates of the modules on CAN, that of the factory first.
const BIT_RATES: [u32; 7] = [1_000_000, 500_000, 250_000, 125_000, 100_000, 50_000, 20_000];

/// A serial line: bits of a request and its answer, and the time that a module, an adapter and a computer may add.
const BITS: u32 = 2 * 9 * 10;
const SERIAL_DELAY: Duration = Duration::from_millis(40);
/// The same on a CAN bus and over a network.
const CAN_DELAY: Duration = Duration::from_millis(10);
const NETWORK_DELAY: Duration = Duration::from_millis(200);

/// A module that was found.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Found {
    /// The port that reaches it, as `--port` takes it.
    pub port: String,
    /// Its name, or what it calls itself if the catalogue does not have it.
    pub module: String,
    /// Firmware, major and minor.
    pub firmware: (u8, u8),
    /// Its address, or its identifier on a CAN bus.
    pub address: u16,
    /// Number of axes; 0 if the catalogue does not have it.
    pub axes: u8,
}

/// The serial ports and CAN interfaces of this computer.
pub fn ports() -> Vec<Url> {
    let serial =
        SerialStream::ports().into_iter().map(|path| Place::Serial { path, baud: BAUD_RATES[0], rs485: false });
    serial.map(Url::to).chain(interfaces().filter_map(|name| format!("can:{name}").parse().ok())).collect()
}

/// CAN interfaces, as Linux lists them.
fn interfaces() -> impl Iterator<Item = String> {
    const CAN: &str = "280";
    let all = std::fs::read_dir("/sys/class/net").into_iter().flatten().flatten();
    all.filter_map(|entry| {
        let kind = std::fs::read_to_string(entry.path().join("type")).ok()?;
        (kind.trim() == CAN).then(|| entry.file_name().to_string_lossy().into_owned())
    })
}

/// The lines of a port: a serial port, or a serial CAN adapter, at all rates, unless it names one other than the default.
fn lines(url: &Url) -> Vec<Url> {
    let (rate, rates) = match &url.place {
        Place::Serial { baud, .. } => (*baud, BAUD_RATES.as_slice()),
        Place::Can { bus: Bus::Slcan(_), bit_rate } => (*bit_rate, BIT_RATES.as_slice()),
        _ => return vec![url.clone()],
    };
    let at = |rate: &u32| {
        let mut place = url.place.clone();
        match &mut place {
            Place::Serial { baud, .. } => *baud = *rate,
            Place::Can { bit_rate, .. } => *bit_rate = *rate,
            _ => {}
        }
        Url { place, ..url.clone() }
    };
    if rate == rates[0] { rates.iter().map(at).collect() } else { vec![url.clone()] }
}

/// The addresses to try on a line: all that there are.
pub fn addresses(url: &Url) -> RangeInclusive<u16> {
    if matches!(url.place, Place::Can { .. }) { 1..=2047 } else { 1..=255 }
}

/// Addresses to ask on a line.
#[derive(Clone, Debug)]
pub struct Leg {
    /// The line.
    pub line: Url,
    /// The addresses.
    pub addresses: Vec<u16>,
}

/// What to ask, in this order: the address of a module as it is delivered on every line, then the other addresses on every line. On a
/// CAN bus all addresses at one bit rate before the next: an adapter at a wrong one disturbs those who talk there.
pub fn plan(url: &Url, addresses: &RangeInclusive<u16>) -> Vec<Leg> {
    let factory = Url::to(url.place.clone()).address.module;
    let (first, rest): (Vec<u16>, Vec<u16>) = addresses.clone().partition(|address| *address == factory);
    let lines = lines(url);
    let leg = |line: &Url, addresses: &Vec<u16>| Leg { line: line.clone(), addresses: addresses.clone() };
    let plan: Vec<Leg> = match url.place {
        Place::Can { .. } => lines.iter().flat_map(|line| [leg(line, &first), leg(line, &rest)]).collect(),
        _ => [first, rest].iter().flat_map(|addresses| lines.iter().map(move |line| leg(line, addresses))).collect(),
    };
    plan.into_iter().filter(|leg| !leg.addresses.is_empty()).collect()
}

/// Asks addresses of a line. `progress` is told each address before it is asked, and ends the search by `false`.
///
/// # Errors
/// When the line does not open or breaks.
pub fn scan(
    url: &Url,
    addresses: impl IntoIterator<Item = u16>,
    progress: impl FnMut(u16) -> bool,
) -> Result<Vec<Found>, Error> {
    scan_on(&Line::open(url)?, url, addresses, progress)
}

/// The same on a line that is open already. A stop of the line ends it.
///
/// # Errors
/// When the line breaks, or is stopped.
pub fn scan_on(
    line: &Line,
    url: &Url,
    addresses: impl IntoIterator<Item = u16>,
    mut progress: impl FnMut(u16) -> bool,
) -> Result<Vec<Found>, Error> {
    let job = line.job();
    let mut found: Vec<Found> = Vec::new();
    for address in addresses {
        line.go_on(job)?;
        if !progress(address) {
            break;
        }
        let mut session = Session::new(line, Address { module: address, reply: None });
        session.set_timeout(patience(&url.place));
        if !session.knock()? {
            continue;
        }
        let own = session.answering_address();
        let module = identify(url, &mut session)?;
        let seen = found.iter().any(|earlier| earlier.port == module.port);
        if !seen {
            found.push(module);
        }
        // A module that answers under any address is alone on its line.
        if own != address && !line.nature().can {
            break;
        }
    }
    Ok(found)
}

fn patience(place: &Place) -> Duration {
    match place {
        Place::Serial { baud, .. } => SERIAL_DELAY + Duration::from_secs(1) * BITS / *baud,
        Place::Can { bus: Bus::Interface(_), .. } => CAN_DELAY,
        Place::Can { .. } => SERIAL_DELAY,
        Place::Tcp { .. } | Place::Sim(_) => NETWORK_DELAY,
    }
}

/// Asks a module what it is.
fn identify(url: &Url, session: &mut Session) -> Result<Found, Error> {
    const BINARY: u8 = 1;
    let text = session.version_text()?;
    let version = session.command(gradus_tmcl::Instruction::new(Opcode::FIRMWARE_VERSION, BINARY, 0, 0))?;
    let [.., major, minor] = version.to_be_bytes();
    let known = session.module().ok();
    let can = session.line().nature().can;
    let module = if can { session.address().module } else { session.answering_address() };
    let reply = if can { u16::try_from(session.get_global(Gp::CanReplyId, 0)?).ok() } else { None };
    Ok(Found {
        port: Url { address: Address { module, reply }, ..url.clone() }.to_string(),
        module: known.map_or(text, |module| module.name.into()),
        firmware: (major, minor),
        address: module,
        axes: known.map_or(0, |module| module.axes),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_module_as_delivered_is_looked_for_first_at_every_rate() {
        let legs = plan(&"/dev/ttyUSB0".parse().unwrap(), &(1..=255));
        assert_eq!(legs.len(), 2 * BAUD_RATES.len());
        let rate = |leg: &Leg| match leg.line.place {
            Place::Serial { baud, .. } => baud,
            _ => 0,
        };
        let (first, rest) = legs.split_at(BAUD_RATES.len());
        assert_eq!(first.iter().map(rate).collect::<Vec<_>>(), BAUD_RATES);
        assert_eq!(rest.iter().map(rate).collect::<Vec<_>>(), BAUD_RATES);
        assert!(first.iter().all(|leg| leg.addresses == [1]));
        assert!(rest.iter().all(|leg| leg.addresses == (2..=255).collect::<Vec<_>>()));
    }

    #[test]
    fn a_plan_asks_no_address_that_is_not_wanted_and_none_twice() {
        let asked = |port: &str, addresses: RangeInclusive<u16>| {
            let legs = plan(&port.parse().unwrap(), &addresses);
            legs.into_iter().map(|leg| (leg.line.to_string(), leg.addresses)).collect::<Vec<_>>()
        };
        let line = "serial:/dev/ttyUSB0?baud=115200";
        assert_eq!(asked(line, 5..=6), [(line.into(), vec![5, 6])]);
        let adapter: Vec<(String, Vec<u16>)> = asked("slcan:/dev/ttyACM0", 1..=2);
        assert_eq!(adapter.len(), 2 * BIT_RATES.len());
        assert_eq!(adapter[1], ("slcan:/dev/ttyACM0".into(), vec![2]), "all addresses before another bit rate");
        assert_eq!(adapter[2], ("slcan:/dev/ttyACM0?bitrate=500000".into(), vec![1]));
        assert_eq!(asked("slcan:/dev/ttyACM0?bitrate=500000", 1..=1).len(), 1);
        assert_eq!(asked("can:can0", 1..=3), [("can:can0".into(), vec![1]), ("can:can0".into(), vec![2, 3])]);
    }
}
