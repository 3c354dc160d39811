//! Names of ports: `sim:tmcm-3351`, `tcp:localhost:4322`, `serial:/dev/ttyACM0?baud=9600`, `can:can0?id=1&reply=2`.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use gradus_tmcl::catalogue::{MODULES, Module};

use crate::Address;

/// How long an answer may take, unless told otherwise.
pub(crate) const REPLY_TIMEOUT: Duration = Duration::from_secs(1);

/// Where a module is and how it is asked.
#[derive(Clone, Debug)]
pub struct Url {
    /// The line.
    pub place: Place,
    /// Address of the module: `?address=N` on a serial line (default 1), `?id=N&reply=N` on a CAN bus (defaults 1 and 2).
    pub address: Address,
    /// How long an answer may take, 1 s unless `?timeout=MS` says otherwise.
    pub timeout: Duration,
    /// True with `?echo=1`: every byte sent comes back, as on a half-duplex adapter whose receiver stays on.
    pub echo: bool,
    /// True with `?guard=1`: the line may deliver an answer twice. A CAN bus counts as such a line anyway.
    pub guard: bool,
}

/// The line to a module.
#[derive(Clone, Debug)]
pub enum Place {
    /// A virtual module in this process, in virtual time: `sim:MODULE`.
    Sim(&'static Module),
    /// A TCP port that carries serial datagrams: `tcp:HOST:PORT`.
    Tcp {
        /// Name or address; an IPv6 address without its brackets.
        host: String,
        /// Port number.
        port: u16,
    },
    /// A serial port: `serial:PATH`, or the path alone.
    Serial {
        /// The device file.
        path: PathBuf,
        /// Bits per second, 9600 unless `?baud=N` says otherwise.
        baud: u32,
        /// True with `?rs485=1`: the port's driver switches an RS-485 transceiver between sending and receiving.
        rs485: bool,
    },
    /// A CAN bus.
    Can {
        /// How it is reached.
        bus: Bus,
        /// Bits per second on the bus, 1000000 unless `?bitrate=N` says otherwise; only an slcan adapter is told.
        bit_rate: u32,
    },
}

/// How a CAN bus is reached.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Bus {
    /// An interface of the Linux kernel: `can:INTERFACE`.
    Interface(String),
    /// A serial CAN adapter: `slcan:PATH?baud=115200` or `slcan:HOST:PORT`.
    Slcan(SlcanPlace),
    /// A bus behind a socketcand server: `socketcand:HOST:PORT/BUS`.
    Socketcand {
        /// Name or address; an IPv6 address without its brackets.
        host: String,
        /// Port number.
        port: u16,
        /// The server's name for the bus.
        bus: String,
    },
}

/// Where a serial CAN adapter is.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum SlcanPlace {
    /// On a serial port.
    Serial {
        /// The device file.
        path: PathBuf,
        /// Bits per second between computer and adapter.
        baud: u32,
    },
    /// Behind a TCP port.
    Tcp {
        /// Name or address; an IPv6 address without its brackets.
        host: String,
        /// Port number.
        port: u16,
    },
}

/// What is wrong with a port's name.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("`{url}` is no port: {problem}; accepted are {FORMS}")]
pub struct UrlError {
    /// What was given.
    pub url: String,
    /// What is wrong with it.
    pub problem: String,
}

const FORMS: &str = "sim:MODULE, tcp:HOST:PORT, serial:PATH?baud=9600 or a path, each with ?address=N; can:INTERFACE, \
                     slcan:PATH, slcan:HOST:PORT, socketcand:HOST:PORT/BUS, each with ?id=N&reply=N; all with ?timeout=MS";

/// Address of a module as it is delivered.
pub(crate) const DEFAULT_ADDRESS: Address = Address::serial(1);
/// The same on a CAN bus.
const DEFAULT_CAN_ADDRESS: Address = Address { module: 1, reply: Some(2) };
const DEFAULT_BAUD: u32 = 9600;
const DEFAULT_SLCAN_BAUD: u32 = 115_200;
const DEFAULT_BIT_RATE: u32 = 1_000_000;
/// The largest CAN identifier of 11 bits.
const LAST_ID: u32 = 0x7ff;

impl FromStr for Url {
    type Err = UrlError;

    fn from_str(text: &str) -> Result<Self, UrlError> {
        parse(text).map_err(|problem| UrlError { url: text.into(), problem })
    }
}

fn parse(text: &str) -> Result<Url, String> {
    let (line, options) = text.split_once('?').unwrap_or((text, ""));
    let mut url = Url::to(place(line)?);
    for option in options.split('&').filter(|option| !option.is_empty()) {
        url.set(option)?;
    }
    Ok(url)
}

fn place(line: &str) -> Result<Place, String> {
    let (scheme, rest) = line.split_once(':').unwrap_or((line, ""));
    match scheme.to_ascii_lowercase().as_str() {
        "sim" => sim(rest),
        "tcp" => tcp(rest.trim_start_matches("//")),
        "serial" => serial(rest),
        "can" => interface(rest).map(can),
        "slcan" => slcan(rest).map(Bus::Slcan).map(can),
        "socketcand" => socketcand(rest.trim_start_matches("//")).map(can),
        other if line.contains(':') && other.bytes().all(|byte| byte.is_ascii_alphabetic()) => {
            Err(format!("there is no kind of port named `{scheme}`"))
        }
        _ => serial(line),
    }
}

fn sim(name: &str) -> Result<Place, String> {
    if name.is_empty() {
        return Err("the module is missing, as in sim:tmcm-3351".into());
    }
    let names = || MODULES.iter().map(|module| module.name.to_lowercase()).collect::<Vec<_>>().join(", ");
    Module::named(name).map(Place::Sim).ok_or_else(|| format!("there is no module `{name}`, only {}", names()))
}

fn tcp(rest: &str) -> Result<Place, String> {
    let (host, port) = host_and_port(rest, "tcp")?;
    Ok(Place::Tcp { host, port })
}

fn host_and_port(rest: &str, scheme: &str) -> Result<(String, u16), String> {
    let (host, port) = rest.rsplit_once(':').ok_or_else(|| format!("{scheme} needs a host and a port number"))?;
    let host = host.strip_prefix('[').and_then(|inner| inner.strip_suffix(']')).unwrap_or(host);
    if host.is_empty() {
        return Err("the host is missing".into());
    }
    let port = port.parse().map_err(|_| format!("`{port}` is no port number (1 to 65535)"))?;
    Ok((host.into(), port))
}

fn serial(path: &str) -> Result<Place, String> {
    if path.is_empty() {
        return Err("the path is missing".into());
    }
    Ok(Place::Serial { path: path.into(), baud: DEFAULT_BAUD, rs485: false })
}

fn can(bus: Bus) -> Place {
    Place::Can { bus, bit_rate: DEFAULT_BIT_RATE }
}

fn interface(name: &str) -> Result<Bus, String> {
    if name.is_empty() {
        Err("the interface is missing, as in can:can0".into())
    } else {
        Ok(Bus::Interface(name.into()))
    }
}

/// A path, or a host and a port number: device files have a slash or no colon.
fn slcan(rest: &str) -> Result<SlcanPlace, String> {
    if rest.is_empty() {
        return Err("the path is missing".into());
    }
    let remote = rest.strip_prefix("//").or_else(|| (!rest.contains('/') && rest.contains(':')).then_some(rest));
    let Some(rest) = remote else { return Ok(SlcanPlace::Serial { path: rest.into(), baud: DEFAULT_SLCAN_BAUD }) };
    let (host, port) = host_and_port(rest, "slcan")?;
    Ok(SlcanPlace::Tcp { host, port })
}

fn socketcand(rest: &str) -> Result<Bus, String> {
    let (server, bus) = rest.rsplit_once('/').ok_or("socketcand needs a bus, as in socketcand:localhost:29536/can0")?;
    if bus.is_empty() || bus.contains(['<', '>', ' ']) {
        return Err(format!("`{bus}` is no name of a bus"));
    }
    let (host, port) = host_and_port(server, "socketcand")?;
    Ok(Bus::Socketcand { host, port, bus: bus.into() })
}

impl Url {
    /// A line with everything else as it is by default.
    pub fn to(place: Place) -> Self {
        let address = if matches!(place, Place::Can { .. }) { DEFAULT_CAN_ADDRESS } else { DEFAULT_ADDRESS };
        Self { place, address, timeout: REPLY_TIMEOUT, echo: false, guard: false }
    }

    /// A virtual module of this process.
    pub fn sim(module: &'static Module) -> Self {
        Self::to(Place::Sim(module))
    }

    fn set(&mut self, option: &str) -> Result<(), String> {
        let (name, value) = option.split_once('=').unwrap_or((option, ""));
        match (name, &mut self.place) {
            ("timeout", _) => self.timeout = Duration::from_millis(number(name, value, 1, 600_000)?),
            ("guard", _) => self.guard = switch(name, value)?,
            ("address", Place::Can { .. }) => return Err("on a CAN bus a module has an identifier: ?id=N".into()),
            ("address", _) => self.address.module = number(name, value, 0, 255)?,
            ("id", Place::Can { .. }) => self.address.module = number(name, value, 0, LAST_ID)?,
            ("reply", Place::Can { .. }) => self.address.reply = Some(number(name, value, 0, LAST_ID)?),
            ("bitrate", Place::Can { bit_rate, .. }) => *bit_rate = number(name, value, 1, DEFAULT_BIT_RATE)?,
            ("id" | "reply" | "bitrate", _) => return Err(format!("only a CAN bus has `{name}`")),
            (
                "baud",
                Place::Serial { baud, .. } | Place::Can { bus: Bus::Slcan(SlcanPlace::Serial { baud, .. }), .. },
            ) => {
                *baud = number(name, value, 1, 10_000_000)?;
            }
            ("baud", _) => return Err("only a serial port has a baud rate".into()),
            ("rs485", Place::Serial { rs485, .. }) => *rs485 = switch(name, value)?,
            ("rs485", _) => return Err("only a serial port switches a transceiver".into()),
            ("echo", Place::Serial { .. } | Place::Tcp { .. }) => self.echo = switch(name, value)?,
            ("echo", _) => return Err("only a serial line has an echo".into()),
            _ => return Err(format!("there is no option `{name}`")),
        }
        Ok(())
    }

    /// The options that differ from their defaults.
    fn options(&self) -> Vec<String> {
        let plain = Self::to(self.place.clone());
        let mut options = match &self.place {
            Place::Serial { baud, rs485, .. } => vec![differing("baud", *baud, DEFAULT_BAUD), on("rs485", *rs485)],
            Place::Can { bus: Bus::Slcan(SlcanPlace::Serial { baud, .. }), bit_rate } => {
                vec![differing("baud", *baud, DEFAULT_SLCAN_BAUD), differing("bitrate", *bit_rate, DEFAULT_BIT_RATE)]
            }
            Place::Can { bit_rate, .. } => vec![differing("bitrate", *bit_rate, DEFAULT_BIT_RATE)],
            _ => Vec::new(),
        };
        let (address, default) = (self.address, plain.address);
        let is_can = matches!(self.place, Place::Can { .. });
        options.push(differing(if is_can { "id" } else { "address" }, address.module, default.module));
        options.push(address.reply.and_then(|reply| differing("reply", reply, default.reply?)));
        options.push(differing("timeout", self.timeout.as_millis(), plain.timeout.as_millis()));
        options.extend([on("echo", self.echo), on("guard", self.guard)]);
        options.into_iter().flatten().collect()
    }
}

fn differing<T: PartialEq + fmt::Display>(name: &str, value: T, default: T) -> Option<String> {
    (value != default).then(|| format!("{name}={value}"))
}

fn on(name: &str, value: bool) -> Option<String> {
    value.then(|| format!("{name}=1"))
}

fn switch(name: &str, value: &str) -> Result<bool, String> {
    Ok(number::<u32>(name, value, 0, 1)? == 1)
}

fn number<T: TryFrom<u32>>(name: &str, value: &str, min: u32, max: u32) -> Result<T, String> {
    let parsed = value.parse().ok().filter(|number| (min..=max).contains(number));
    parsed.and_then(|number| T::try_from(number).ok()).ok_or_else(|| format!("{name} is {min} to {max}, not `{value}`"))
}

/// A host as it stands in front of a port number.
fn bracketed(host: &str) -> String {
    if host.contains(':') { format!("[{host}]") } else { host.into() }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Sim(module) => write!(f, "sim:{}", module.name.to_lowercase()),
            Self::Tcp { host, port } => write!(f, "tcp:{}:{port}", bracketed(host)),
            Self::Serial { path, .. } => write!(f, "serial:{}", path.display()),
            Self::Can { bus: Bus::Interface(name), .. } => write!(f, "can:{name}"),
            Self::Can { bus: Bus::Slcan(SlcanPlace::Serial { path, .. }), .. } => write!(f, "slcan:{}", path.display()),
            Self::Can { bus: Bus::Slcan(SlcanPlace::Tcp { host, port }), .. } => {
                write!(f, "slcan:{}:{port}", bracketed(host))
            }
            Self::Can { bus: Bus::Socketcand { host, port, bus }, .. } => {
                write!(f, "socketcand:{}:{port}/{bus}", bracketed(host))
            }
        }
    }
}

impl fmt::Display for Url {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}", self.place)?;
        match self.options().as_slice() {
            [] => Ok(()),
            options => write!(f, "?{}", options.join("&")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_parses_and_prints_in_its_normal_form() {
        let cases = [
            ("sim:tmcm-3351", "sim:tmcm-3351"),
            ("sim:TMCM-3351?address=7", "sim:tmcm-3351?address=7"),
            ("tcp:localhost:4322", "tcp:localhost:4322"),
            ("tcp://localhost:4322", "tcp:localhost:4322"),
            ("tcp:[::1]:4322?address=2", "tcp:[::1]:4322?address=2"),
            ("serial:/dev/ttyACM0", "serial:/dev/ttyACM0"),
            ("serial:/dev/ttyACM0?baud=115200&address=3", "serial:/dev/ttyACM0?baud=115200&address=3"),
            ("/dev/ttyUSB0", "serial:/dev/ttyUSB0"),
            ("./pty?address=0", "serial:./pty?address=0"),
            ("/dev/serial/by-path/pci-0000:00:14.0-usb-0:1", "serial:/dev/serial/by-path/pci-0000:00:14.0-usb-0:1"),
            ("COM3", "serial:COM3"),
            ("SIM:tmcm-3351", "sim:tmcm-3351"),
            ("Tcp:localhost:4322", "tcp:localhost:4322"),
            ("SERIAL:/dev/ttyACM0", "serial:/dev/ttyACM0"),
            ("./sim", "serial:./sim"),
            ("/dev/ttyUSB0?rs485=1&echo=1", "serial:/dev/ttyUSB0?rs485=1&echo=1"),
            ("tcp:localhost:4322?echo=1&timeout=200&guard=1", "tcp:localhost:4322?timeout=200&echo=1&guard=1"),
            ("can:can0", "can:can0"),
            ("can:can0?id=1&reply=2", "can:can0"),
            ("can:vcan0?id=2047&reply=3", "can:vcan0?id=2047&reply=3"),
            ("slcan:/dev/ttyACM0?bitrate=500000&baud=9600", "slcan:/dev/ttyACM0?baud=9600&bitrate=500000"),
            ("slcan:localhost:3333?id=5", "slcan:localhost:3333?id=5"),
            ("slcan:[::1]:3333", "slcan:[::1]:3333"),
            ("slcan:COM3", "slcan:COM3"),
            ("socketcand:localhost:29536/can0?reply=7", "socketcand:localhost:29536/can0?reply=7"),
        ];
        for (text, normal) in cases {
            assert_eq!(text.parse::<Url>().unwrap().to_string(), normal, "{text}");
        }
    }

    #[test]
    fn a_wrong_url_says_what_is_wrong_and_what_is_accepted() {
        let cases = [
            ("sim:tmcm-9999", "there is no module `tmcm-9999`"),
            ("sim:", "the module is missing, as in sim:tmcm-3351"),
            ("sim", "the module is missing, as in sim:tmcm-3351"),
            ("tcp", "tcp needs a host and a port number"),
            ("serial", "the path is missing"),
            ("tcp:localhost", "tcp needs a host and a port number"),
            ("tcp::4322", "the host is missing"),
            ("tcp:localhost:99999", "`99999` is no port number"),
            ("udp:localhost:4322", "no kind of port named `udp`"),
            ("serial:", "the path is missing"),
            ("", "the path is missing"),
            ("/dev/ttyACM0?baud=fast", "baud is 1 to 10000000, not `fast`"),
            ("/dev/ttyACM0?speed=9600", "no option `speed`"),
            ("tcp:localhost:4322?baud=9600", "only a serial port has a baud rate"),
            ("sim:tmcm-3351?address=256", "address is 0 to 255, not `256`"),
            ("can:", "the interface is missing, as in can:can0"),
            ("can:can0?address=1", "on a CAN bus a module has an identifier: ?id=N"),
            ("can:can0?id=2048", "id is 0 to 2047, not `2048`"),
            ("tcp:localhost:4322?id=1", "only a CAN bus has `id`"),
            ("tcp:localhost:4322?rs485=1", "only a serial port switches a transceiver"),
            ("can:can0?echo=1", "only a serial line has an echo"),
            ("serial:/dev/ttyUSB0?echo=yes", "echo is 0 to 1, not `yes`"),
            ("slcan:", "the path is missing"),
            ("socketcand:localhost:29536", "socketcand needs a bus"),
            ("socketcand:localhost/can0", "socketcand needs a host and a port number"),
        ];
        for (text, problem) in cases {
            let message = text.parse::<Url>().unwrap_err().to_string();
            assert!(message.contains(problem), "{text}: {message}");
            assert!(message.contains("accepted are sim:MODULE"), "{text}: {message}");
        }
    }
}
