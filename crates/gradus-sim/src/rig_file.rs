//! Bench files of several modules: how they hang on buses, as TOML.
//!
//! ```toml
//! [[bus]]
//! name = "segment"
//! kind = "rs485"                           # usb, rs232, rs485 or can
//! baud = 9600                              # of rs232 and rs485: that of hosts and modules; "strict" if left out
//! endpoints = ["pty:/tmp/segment", "tcp:127.0.0.1:4322"]
//!
//! [[bus]]
//! name = "field"
//! kind = "can"
//! bit_rate = 1_000_000                     # this is the default
//! endpoints = ["slcan:127.0.0.1:0", "socketcand:127.0.0.1:28600"]
//! faults = "late-replies"                  # a profile by name, or a table such as { flipped = 0.001 }
//! seed = 7                                 # of the dice for the faults
//! event = [{ at = 60.0, do = "cut 1" }]    # a line of the console for this bus
//!
//! [[module]]
//! name = "x"
//! bus = ["segment", "field"]               # or one name
//! address = 1                              # secondary_address, can_id, can_reply_id, can_secondary_id as well
//! eeprom = "x.eeprom"                      # a file beside this one; without it the memory is new every time
//! module = "tmcm-3351"                     # this and all below as in a file of one module
//! axis.0 = { start = 42.0, travel.left.at = 0.0 }
//!
//! [[module]]
//! name = "y"
//! bus = "segment"
//! address = 3
//! module = "tmcm-3351"
//! ```
//!
//! A module without `address` (and so on) has what its EEPROM holds. With `baud = "strict"` a
//! host on a pseudo-terminal has the rate that it sets, one on TCP 9600, and modules have what their EEPROM holds; so they have without
//! `bit_rate`, which is that of all hosts. A bus may also say `timing = false`: nothing takes time then;
//! `turn_around_us` of an RS-485 segment; `gap_ms`, the pause after which a new datagram begins (0: none; if left out 50 ms of the
//! wall clock on pseudo-terminals and TCP); `echo = true` for an adapter that hears itself.
//!
//! Not here: the keys of a module's machine, see [`bench_file`](crate::bench_file); what the buses do, see [`Serial`] and [`Can`].

use std::fmt;
use std::fs;
use std::num::NonZeroU32;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use gradus_tmcl::catalogue::{Gp, Module};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::bench::rate_value;
use crate::bench_file::{BenchFile, BenchFileError, Document, is_rig};
use crate::problem::{Misfit, Problem};
use crate::quantity::microseconds;
use crate::{BusChange, BusKind, Can, Eeprom, EepromError, Endpoint, LineRates, Profile, Rig, Serial};

/// Keys of a module's table that a file of one module has not.
const PLACE_KEYS: [&str; 9] = [
    "name",
    "bus",
    "eeprom",
    "address",
    "secondary_address",
    "can_id",
    "can_reply_id",
    "can_secondary_id",
    "telegram_pause_ms",
];

/// What a file of several modules says.
#[derive(Clone, Debug)]
pub struct RigFile {
    /// Where the EEPROM files are.
    folder: PathBuf,
    buses: Vec<BusTable>,
    modules: Vec<(PlaceTable, BenchFile)>,
    events: Vec<(u64, usize, BusChange)>,
}

impl RigFile {
    /// Reads a file; `None` if it is one of a single module, see [`BenchFile`].
    ///
    /// # Errors
    /// When it cannot be read or something is wrong with it.
    pub fn read(file: &Path) -> Result<Option<Self>, BenchFileError> {
        let text = fs::read_to_string(file).map_err(|source| BenchFileError::Read { file: file.into(), source })?;
        let parsed = Self::parse(&text).map_err(|problem| BenchFileError::Wrong { file: file.into(), problem })?;
        Ok(parsed.map(|rig| Self { folder: file.parent().unwrap_or(Path::new("")).into(), ..rig }))
    }

    /// Understands the text of a file; `None` if it is one of a single module.
    ///
    /// # Errors
    /// What is wrong with it first.
    pub fn parse(text: &str) -> Result<Option<Self>, Problem> {
        let Some(root) = DeTable::parse(text).ok().filter(|_| is_rig(text)) else { return Ok(None) };
        Self::build_from(root).map(Some).map_err(|misfit| misfit.locate(text))
    }

    fn build_from(mut root: Spanned<DeTable>) -> Result<Self, Misfit> {
        let modules = match root.get_mut().remove("module").map(Spanned::into_inner) {
            Some(DeValue::Array(modules)) => modules.into_iter().map(module).collect::<Result<Vec<_>, _>>()?,
            _ => Vec::new(),
        };
        let RigTable { bus: buses } = understand(root)?;
        let rig = Self { folder: PathBuf::new(), buses, modules, events: Vec::new() };
        rig.checked()
    }

    fn checked(mut self) -> Result<Self, Misfit> {
        unique(self.buses.iter().map(|bus| &bus.name).chain(self.modules.iter().map(|(place, _)| &place.name)))?;
        for (index, bus) in self.buses.iter().enumerate() {
            bus.check()?;
            for event in &bus.event {
                self.events.push((event.at, index, event.change()?));
            }
        }
        for (place, file) in &self.modules {
            for bus in self.buses_of(place)? {
                self.buses[bus].check_rate_for(file.module)?;
            }
        }
        let connected = |bus: &BusTable| self.modules.iter().filter(|(place, _)| place.hangs_on(&bus.name)).count();
        let crowded = self.buses.iter().find(|bus| bus.kind.get_ref().is_point_to_point() && connected(bus) > 1);
        match crowded {
            Some(bus) => {
                let name = if *bus.kind.get_ref() == Kind::Usb { "USB" } else { "RS-232" };
                let message = format!("{name} is point to point and has one module; use rs485 or several buses");
                Err(wrong(&bus.kind, message))
            }
            None => Ok(self),
        }
    }

    fn buses_of(&self, place: &PlaceTable) -> Result<Vec<usize>, Misfit> {
        let number = |name: &String| {
            let found = self.buses.iter().position(|bus| bus.name.get_ref() == name);
            found.ok_or_else(|| {
                let known: Vec<&str> = self.buses.iter().map(|bus| bus.name.get_ref().as_str()).collect();
                wrong(&place.bus, format!("there is no bus `{name}`, only {}", known.join(", ")))
            })
        };
        place.bus.get_ref().names().iter().map(number).collect()
    }

    /// The endpoints that hosts find, with the numbers of their buses.
    pub fn endpoints(&self) -> Vec<(usize, Endpoint)> {
        let of = |(bus, table): (usize, &BusTable)| {
            table.endpoints.iter().map(|endpoint| (bus, endpoint.get_ref().0.clone())).collect::<Vec<_>>()
        };
        self.buses.iter().enumerate().flat_map(of).collect()
    }

    /// Builds the rig and switches the modules on.
    ///
    /// # Errors
    /// When an EEPROM file cannot be used.
    pub fn build(&self) -> Result<Rig, EepromError> {
        let mut rig = Rig::default();
        for bus in &self.buses {
            let number = rig.add_bus(bus.name.get_ref(), bus.kind());
            rig.change(number, BusChange::Faults(bus.faults.0, bus.seed));
        }
        for (place, file) in &self.modules {
            let eeprom = match &place.eeprom {
                Some(name) => Eeprom::open(&self.folder.join(name), file.module)?,
                None => Eeprom::of(file.module),
            };
            let mut bench = file.clone().build(eeprom);
            for (parameter, value) in place.settings() {
                bench.set_global(parameter, *value.get_ref() as i32);
            }
            let buses = self.buses_of(place).unwrap_or_default();
            for (parameter, rate) in buses.iter().filter_map(|bus| self.buses[*bus].rate_of_modules()) {
                bench.set_rate(parameter, rate);
            }
            let module = rig.add_module(place.name.get_ref(), bench);
            for bus in buses {
                rig.connect(module, bus);
            }
        }
        for (at_us, bus, change) in &self.events {
            rig.schedule(*at_us, *bus, *change);
        }
        Ok(rig)
    }
}

fn understand<'de, T: Deserialize<'de>>(table: Spanned<DeTable<'de>>) -> Result<T, Misfit> {
    T::deserialize(toml::Deserializer::from(table)).map_err(|error| Misfit::new(error.span(), error.message()))
}

/// The table of a module: its place, and the rest as in a file of one module.
fn module(value: Spanned<DeValue>) -> Result<(PlaceTable, BenchFile), Misfit> {
    let span = value.span();
    let DeValue::Table(mut machine) = value.into_inner() else {
        return Err(Misfit::new(Some(span), "expected a table: [[module]]"));
    };
    let mut place = DeTable::new();
    for key in PLACE_KEYS {
        if let Some((key, value)) = machine.remove_entry(key) {
            place.insert(key, value);
        }
    }
    let place: PlaceTable = understand(Spanned::new(span.clone(), place))?;
    let document: Document = understand(Spanned::new(span, machine))?;
    let file = document.build()?;
    place.check(file.module)?;
    Ok((place, file))
}

fn wrong<T>(at: &Spanned<T>, message: impl Into<String>) -> Misfit {
    Misfit::new(Some(at.span()), message)
}

fn unique<'a>(names: impl Iterator<Item = &'a Spanned<String>>) -> Result<(), Misfit> {
    let mut known: Vec<&str> = Vec::new();
    for name in names {
        if known.contains(&name.get_ref().as_str()) {
            return Err(wrong(name, format!("there are two of the name `{}`", name.get_ref())));
        }
        known.push(name.get_ref());
    }
    Ok(())
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RigTable {
    bus: Vec<BusTable>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with name and kind")]
struct BusTable {
    name: Spanned<String>,
    kind: Spanned<Kind>,
    #[serde(default)]
    endpoints: Vec<Spanned<EndpointText>>,
    baud: Option<Spanned<Baud>>,
    bit_rate: Option<Spanned<NonZeroU32>>,
    #[serde(default = "yes")]
    timing: bool,
    turn_around_us: Option<Spanned<u32>>,
    gap_ms: Option<Spanned<u16>>,
    #[serde(default)]
    echo: bool,
    #[serde(default)]
    faults: Faults,
    #[serde(default)]
    seed: u64,
    #[serde(default)]
    event: Vec<BusEvent>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Usb,
    Rs232,
    Rs485,
    Can,
}

impl Kind {
    fn is_point_to_point(self) -> bool {
        matches!(self, Self::Usb | Self::Rs232)
    }
}

/// The rate of a serial line.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged, expecting = "expected bits a second, or \"strict\"")]
enum Baud {
    Rate(NonZeroU32),
    Word(Strict),
}

#[derive(Clone, Copy, Debug, Deserialize)]
enum Strict {
    /// Everybody has the rate that he sets.
    #[serde(rename = "strict")]
    Strict,
}

fn yes() -> bool {
    true
}

impl BusTable {
    fn check(&self) -> Result<(), Misfit> {
        let kind = *self.kind.get_ref();
        let of = |key: Option<Range<usize>>, right: &[Kind], names: &str| match key {
            Some(span) if !right.contains(&kind) => {
                Err(Misfit::new(Some(span), format!("only a bus of the kind {names} has this key")))
            }
            _ => Ok(()),
        };
        of(self.baud.as_ref().map(Spanned::span), &[Kind::Rs232, Kind::Rs485], "rs232 or rs485")?;
        of(self.turn_around_us.as_ref().map(Spanned::span), &[Kind::Rs485], "rs485")?;
        of(self.bit_rate.as_ref().map(Spanned::span), &[Kind::Can], "can")?;
        match self.endpoints.iter().find(|endpoint| endpoint.get_ref().0.is_can() != (kind == Kind::Can)) {
            Some(endpoint) => Err(wrong(
                endpoint,
                match kind {
                    Kind::Can => "a CAN bus has the endpoints slcan, socketcand and can",
                    _ => "a serial line has the endpoints pty and tcp",
                },
            )),
            None => Ok(()),
        }
    }

    /// The rate that the file wants the modules to have, with its parameter; none if it names no rate or nothing takes time.
    fn rate_of_modules(&self) -> Option<(Gp, u32)> {
        let baud = self.baud().filter(|_| self.timing).map(|baud| (Gp::SerialBaudRate, baud));
        baud.or(self.bit_rate.as_ref().map(|rate| (Gp::CanBitRate, rate.get_ref().get())))
    }

    fn check_rate_for(&self, module: &Module) -> Result<(), Misfit> {
        let Some((parameter, rate)) = self.rate_of_modules() else { return Ok(()) };
        if rate_value(module, parameter, rate).is_some() {
            return Ok(());
        }
        let span = self.baud.as_ref().map(Spanned::span).or(self.bit_rate.as_ref().map(Spanned::span));
        let row = module.global_parameters.iter().find(|row| row.id == parameter);
        let known: Vec<&str> = row.iter().flat_map(|row| row.values.choices()).map(|choice| choice.text).collect();
        Err(Misfit::new(span, format!("the {} has no such rate, only {}", module.name, known.join(", "))))
    }

    /// Bits a second; `None`: everybody has his own.
    fn baud(&self) -> Option<u32> {
        match self.baud.as_ref()?.get_ref() {
            Baud::Rate(rate) => Some(rate.get()),
            Baud::Word(Strict::Strict) => None,
        }
    }

    fn kind(&self) -> BusKind {
        let bit_rate = self.bit_rate.as_ref().map_or(Can::DEFAULT.bit_rate, |rate| rate.get_ref().get());
        let baud = self.baud().unwrap_or(LineRates::FACTORY.baud);
        match self.kind.get_ref() {
            Kind::Can => BusKind::Can(Can { bit_rate, timing: self.timing }),
            Kind::Usb => BusKind::Serial(self.serial(Serial::USB)),
            Kind::Rs232 => BusKind::Serial(self.serial(Serial::rs232(baud))),
            Kind::Rs485 => BusKind::Serial(self.serial(Serial::rs485(baud))),
        }
    }

    fn serial(&self, serial: Serial) -> Serial {
        let serial = if self.timing { serial } else { serial.without_timing() };
        let turn_around_us = self.turn_around_us.as_ref().map(|us| *us.get_ref()).or(serial.turn_around_us);
        let gap_us = self.gap_ms.as_ref().map_or(0, |ms| u32::from(*ms.get_ref()) * 1000);
        let strict = *self.kind.get_ref() != Kind::Usb && self.baud().is_none();
        Serial { turn_around_us, gap_us, echo: self.echo, strict, ..serial }
    }
}

/// Either a name or a table.
#[derive(Clone, Copy, Debug, Default)]
struct Faults(Profile);

impl<'de> Deserialize<'de> for Faults {
    fn deserialize<D: Deserializer<'de>>(value: D) -> Result<Self, D::Error> {
        value.deserialize_any(NameOrTable).map(Self)
    }
}

/// Reads a profile.
struct NameOrTable;

impl<'de> Visitor<'de> for NameOrTable {
    type Value = Profile;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a profile's name or a table such as { flipped = 0.001 }")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Profile, E> {
        name.parse().map_err(E::custom)
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<Profile, A::Error> {
        Profile::deserialize(MapAccessDeserializer::new(table))
    }
}

#[derive(Clone, Debug)]
struct EndpointText(Endpoint);

impl<'de> Deserialize<'de> for EndpointText {
    fn deserialize<D: Deserializer<'de>>(value: D) -> Result<Self, D::Error> {
        let text = String::deserialize(value)?;
        Endpoint::from_str(&text).map(Self).map_err(D::Error::custom)
    }
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with at and do")]
struct BusEvent {
    #[serde(deserialize_with = "microseconds")]
    at: u64,
    #[serde(rename = "do")]
    line: Spanned<String>,
}

impl BusEvent {
    fn change(&self) -> Result<BusChange, Misfit> {
        match BusChange::parse(self.line.get_ref()) {
            Ok(Some(change)) => Ok(change),
            Ok(None) => {
                Err(wrong(&self.line, "expected a line of the console that changes a bus: cut, babble or faults"))
            }
            Err(error) => Err(wrong(&self.line, error.to_string())),
        }
    }
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with name and bus")]
struct PlaceTable {
    name: Spanned<String>,
    bus: Spanned<Names>,
    eeprom: Option<PathBuf>,
    address: Option<Spanned<i64>>,
    secondary_address: Option<Spanned<i64>>,
    telegram_pause_ms: Option<Spanned<i64>>,
    can_id: Option<Spanned<i64>>,
    can_reply_id: Option<Spanned<i64>>,
    can_secondary_id: Option<Spanned<i64>>,
}

/// One name or several.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged, expecting = "the name of a bus or an array of names")]
enum Names {
    One(String),
    Several(Vec<String>),
}

impl Names {
    fn names(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::Several(names) => names,
        }
    }
}

impl PlaceTable {
    fn hangs_on(&self, bus: &Spanned<String>) -> bool {
        self.bus.get_ref().names().contains(bus.get_ref())
    }

    /// The global parameters that the file sets.
    fn settings(&self) -> impl Iterator<Item = (Gp, &Spanned<i64>)> {
        let all = [
            (Gp::SerialAddress, &self.address),
            (Gp::SerialSecondaryAddress, &self.secondary_address),
            (Gp::TelegramPause, &self.telegram_pause_ms),
            (Gp::CanId, &self.can_id),
            (Gp::CanReplyId, &self.can_reply_id),
            (Gp::CanSecondaryId, &self.can_secondary_id),
        ];
        all.into_iter().filter_map(|(parameter, value)| value.as_ref().map(|value| (parameter, value)))
    }

    fn check(&self, module: &Module) -> Result<(), Misfit> {
        for (parameter, value) in self.settings() {
            let row = module.global_parameters.iter().find(|row| row.id == parameter);
            let row = row.ok_or_else(|| wrong(value, format!("the {} has no such parameter", module.name)))?;
            if !(row.min..=row.max).contains(value.get_ref()) {
                return Err(wrong(value, format!("expected a whole number from {} to {}", row.min, row.max)));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
