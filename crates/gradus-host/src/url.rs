//! Names of ports: `sim:tmcm-3351`, `tcp:localhost:4322`, `serial:/dev/ttyACM0?baud=9600`.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use gradus_tmcl::catalogue::{MODULES, Module};

/// Where a module is and under which address it is asked.
#[derive(Clone, Debug)]
pub struct Url {
    /// The line.
    pub place: Place,
    /// Address that requests carry, 1 unless `?address=N` says otherwise.
    pub address: u8,
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
    },
}

/// What is wrong with a port's name.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "`{url}` is no port: {problem}; accepted are sim:MODULE, tcp:HOST:PORT, serial:PATH?baud=9600 or a path, each with ?address=N"
)]
pub struct UrlError {
    /// What was given.
    pub url: String,
    /// What is wrong with it.
    pub problem: String,
}

/// Address of a module as it is delivered.
pub(crate) const DEFAULT_ADDRESS: u8 = 1;
const DEFAULT_BAUD: u32 = 9600;

impl FromStr for Url {
    type Err = UrlError;

    fn from_str(text: &str) -> Result<Self, UrlError> {
        parse(text).map_err(|problem| UrlError { url: text.into(), problem })
    }
}

fn parse(text: &str) -> Result<Url, String> {
    let (line, options) = text.split_once('?').unwrap_or((text, ""));
    let mut url = Url { place: place(line)?, address: DEFAULT_ADDRESS };
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
    let (host, port) = rest.rsplit_once(':').ok_or("tcp needs a host and a port number")?;
    let host = host.strip_prefix('[').and_then(|inner| inner.strip_suffix(']')).unwrap_or(host);
    if host.is_empty() {
        return Err("the host is missing".into());
    }
    let port = port.parse().map_err(|_| format!("`{port}` is no port number (1 to 65535)"))?;
    Ok(Place::Tcp { host: host.into(), port })
}

fn serial(path: &str) -> Result<Place, String> {
    if path.is_empty() {
        return Err("the path is missing".into());
    }
    Ok(Place::Serial { path: path.into(), baud: DEFAULT_BAUD })
}

impl Url {
    fn set(&mut self, option: &str) -> Result<(), String> {
        let (name, value) = option.split_once('=').unwrap_or((option, ""));
        match (name, &mut self.place) {
            ("address", _) => self.address = number(name, value, 0, 255)?,
            ("baud", Place::Serial { baud, .. }) => *baud = number(name, value, 1, 10_000_000)?,
            ("baud", _) => return Err("only a serial port has a baud rate".into()),
            _ => return Err(format!("there is no option `{name}`")),
        }
        Ok(())
    }
}

fn number<T: TryFrom<u32>>(name: &str, value: &str, min: u32, max: u32) -> Result<T, String> {
    let parsed = value.parse().ok().filter(|number| (min..=max).contains(number));
    parsed.and_then(|number| T::try_from(number).ok()).ok_or_else(|| format!("{name} is {min} to {max}, not `{value}`"))
}

impl fmt::Display for Url {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mut mark = '?';
        match &self.place {
            Place::Sim(module) => write!(f, "sim:{}", module.name.to_lowercase())?,
            Place::Tcp { host, port } if host.contains(':') => write!(f, "tcp:[{host}]:{port}")?,
            Place::Tcp { host, port } => write!(f, "tcp:{host}:{port}")?,
            Place::Serial { path, baud } => {
                write!(f, "serial:{}", path.display())?;
                if *baud != DEFAULT_BAUD {
                    write!(f, "?baud={baud}")?;
                    mark = '&';
                }
            }
        }
        if self.address != DEFAULT_ADDRESS {
            write!(f, "{mark}address={}", self.address)?;
        }
        Ok(())
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
        ];
        for (text, problem) in cases {
            let message = text.parse::<Url>().unwrap_err().to_string();
            assert!(message.contains(problem), "{text}: {message}");
            assert!(message.contains("accepted are sim:MODULE"), "{text}: {message}");
        }
    }
}
