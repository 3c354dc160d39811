//! Values that survive a loss of power.
//!
//! The memory is a row of records of sixteen bytes, one for every thing that can be stored. A record has two slots; a write
//! goes to the older one and becomes valid with its last byte, the header. A power cut at any byte therefore leaves the old
//! or the new value, and touches no other record.
//!
//! A slot is a header and seven bytes. The header holds a sequence number (1, 2, 3, 1, ...; 0 is an empty slot) and a check
//! sum of six bits.

use gradus_tmcl::catalogue::{Access, Module};

use crate::ports::Store;

const SLOT: u32 = 8;
const RECORD: u32 = 2 * SLOT;

/// User variables that STGP stores: the first 56 (TMCM-3351 manual §5.3).
pub(crate) const STORED_VARIABLES: u8 = 56;

/// What a record holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Key {
    /// A command of program memory.
    Program(u16),
    /// A row of the catalogue's global parameters.
    Global(usize),
    /// A user variable.
    Variable(u8),
    /// A coordinate of an axis.
    Coordinate(u8, usize),
    /// A row of the catalogue's axis parameters, of an axis.
    Axis(usize, usize),
}

/// Bytes of memory that a module needs.
pub const fn store_size(catalogue: &Module) -> u32 {
    let coordinates = catalogue.coordinates as u32 * catalogue.axes as u32;
    let globals = catalogue.global_parameters.len() as u32;
    let parameters = if stores_axis_parameters(catalogue) { axis_records(catalogue) } else { 0 };
    let records = catalogue.program_len as u32 + globals + STORED_VARIABLES as u32 + coordinates + parameters;
    records * RECORD
}

const fn axis_records(catalogue: &Module) -> u32 {
    catalogue.axis_parameters.len() as u32 * catalogue.axes as u32
}

/// True if STAP can store a parameter of the module.
pub(crate) const fn stores_axis_parameters(catalogue: &Module) -> bool {
    let mut row = 0;
    while row < catalogue.axis_parameters.len() {
        if matches!(catalogue.axis_parameters[row].access, Access::Rwe) {
            return true;
        }
        row += 1;
    }
    false
}

/// The records of a module in its [`Store`].
#[derive(Clone, Debug)]
pub(crate) struct Eeprom<S> {
    catalogue: &'static Module,
    pub(crate) store: S,
}

#[derive(Clone, Copy)]
struct Slot {
    address: u32,
    /// 1, 2 or 3; 0 when the slot holds nothing.
    sequence: u8,
    bytes: [u8; 7],
}

impl<S: Store> Eeprom<S> {
    pub(crate) fn new(catalogue: &'static Module, store: S) -> Self {
        Self { catalogue, store }
    }

    /// The stored bytes, `None` if nothing was ever stored.
    pub(crate) fn load(&mut self, key: Key) -> Option<[u8; 7]> {
        let (newer, _) = self.slots(key);
        (newer.sequence != 0).then_some(newer.bytes)
    }

    /// Stores the bytes, unless they are stored already.
    pub(crate) fn save(&mut self, key: Key, bytes: [u8; 7]) {
        let (newer, older) = self.slots(key);
        if newer.sequence != 0 && newer.bytes == bytes {
            return;
        }
        let sequence = newer.sequence % 3 + 1;
        self.write(older.address, 0);
        for (address, byte) in (older.address + 1..).zip(bytes) {
            self.write(address, byte);
        }
        self.write(older.address, header(sequence, &bytes));
    }

    /// Empties the record, so that the default holds again.
    pub(crate) fn clear(&mut self, key: Key) {
        let (newer, older) = self.slots(key);
        for slot in [older, newer] {
            if slot.sequence != 0 {
                self.write(slot.address, 0);
            }
        }
    }

    pub(crate) fn load_value(&mut self, key: Key) -> Option<i32> {
        let [v3, v2, v1, v0, ..] = self.load(key)?;
        Some(i32::from_be_bytes([v3, v2, v1, v0]))
    }

    pub(crate) fn save_value(&mut self, key: Key, value: i32) {
        let [v3, v2, v1, v0] = value.to_be_bytes();
        self.save(key, [v3, v2, v1, v0, 0, 0, 0]);
    }

    /// Empties every record of parameters, variables and coordinates; the program stays.
    pub(crate) fn clear_settings(&mut self) {
        for row in 0..self.catalogue.global_parameters.len() {
            self.clear(Key::Global(row));
        }
        for variable in 0..STORED_VARIABLES {
            self.clear(Key::Variable(variable));
        }
        for coordinate in 0..self.catalogue.coordinates {
            for axis in 0..usize::from(self.catalogue.axes) {
                self.clear(Key::Coordinate(coordinate, axis));
            }
        }
        if stores_axis_parameters(self.catalogue) {
            self.clear_axis_parameters();
        }
    }

    fn clear_axis_parameters(&mut self) {
        for row in 0..self.catalogue.axis_parameters.len() {
            for axis in 0..usize::from(self.catalogue.axes) {
                self.clear(Key::Axis(row, axis));
            }
        }
    }

    /// The slot that counts and the one to write next.
    fn slots(&mut self, key: Key) -> (Slot, Slot) {
        let address = self.record(key) * RECORD;
        let (a, b) = (self.slot(address), self.slot(address + SLOT));
        // The sequence 0 of an empty slot is older than any other.
        let a_is_newer = b.sequence == 0 || (a.sequence != 0 && a.sequence == b.sequence % 3 + 1);
        if a_is_newer { (a, b) } else { (b, a) }
    }

    fn slot(&mut self, address: u32) -> Slot {
        let mut raw = [0; SLOT as usize];
        self.store.read(address, &mut raw);
        let [head, bytes @ ..] = raw;
        let sequence = head >> 6;
        let valid = sequence != 0 && head == header(sequence, &bytes);
        Slot { address, sequence: if valid { sequence } else { 0 }, bytes }
    }

    fn write(&mut self, address: u32, byte: u8) {
        let mut old = [0];
        self.store.read(address, &mut old);
        if old[0] != byte {
            self.store.write(address, byte);
        }
    }

    fn record(&self, key: Key) -> u32 {
        let globals = u32::from(self.catalogue.program_len);
        let variables = globals + self.catalogue.global_parameters.len() as u32;
        let coordinates = variables + u32::from(STORED_VARIABLES);
        let axes = u32::from(self.catalogue.axes);
        let parameters = coordinates + u32::from(self.catalogue.coordinates) * axes;
        match key {
            Key::Program(address) => u32::from(address),
            Key::Global(row) => globals + row as u32,
            Key::Variable(number) => variables + u32::from(number),
            Key::Coordinate(number, axis) => coordinates + u32::from(number) * axes + axis as u32,
            Key::Axis(row, axis) => parameters + row as u32 * axes + axis as u32,
        }
    }
}

/// True for parameters that every write stores.
pub(crate) fn stored_at_once(access: Access) -> bool {
    access == Access::Rwa
}

/// Sequence number and CRC-6 (x^6 + x + 1) of it and the bytes. The start value makes a slot full of ones invalid.
fn header(sequence: u8, bytes: &[u8; 7]) -> u8 {
    let mut crc = 0x15 ^ sequence;
    for byte in bytes {
        for bit in (0..8).rev() {
            let carry = (crc >> 5 ^ byte >> bit) & 1;
            crc = (crc << 1 & 0x3f) ^ (carry * 0x03);
        }
    }
    sequence << 6 | crc
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use gradus_tmcl::catalogue::{MODULES, TMCM_3351};

    use super::*;

    struct Bytes(std::vec::Vec<u8>);

    impl Store for Bytes {
        fn read(&mut self, address: u32, bytes: &mut [u8]) {
            bytes.copy_from_slice(&self.0[address as usize..][..bytes.len()]);
        }

        fn write(&mut self, address: u32, byte: u8) {
            self.0[address as usize] = byte;
        }
    }

    fn filled(byte: u8) -> Eeprom<Bytes> {
        filled_for(&TMCM_3351, byte)
    }

    fn filled_for(module: &'static Module, byte: u8) -> Eeprom<Bytes> {
        Eeprom::new(module, Bytes(std::vec![byte; store_size(module) as usize]))
    }

    fn keys(module: &'static Module) -> impl Iterator<Item = Key> {
        let axes = usize::from(module.axes);
        let rows = if stores_axis_parameters(module) { module.axis_parameters.len() } else { 0 };
        (0..module.program_len)
            .map(Key::Program)
            .chain((0..module.global_parameters.len()).map(Key::Global))
            .chain((0..STORED_VARIABLES).map(Key::Variable))
            .chain(
                (0..module.coordinates)
                    .flat_map(move |number| (0..axes).map(move |axis| Key::Coordinate(number, axis))),
            )
            .chain((0..rows).flat_map(move |row| (0..axes).map(move |axis| Key::Axis(row, axis))))
    }

    #[test]
    fn every_key_has_a_record_of_its_own_and_they_fill_the_memory() {
        for module in MODULES.iter().copied() {
            let eeprom = filled_for(module, 0);
            let records: BTreeSet<u32> = keys(module).map(|key| eeprom.record(key)).collect();
            assert_eq!(records.len(), keys(module).count(), "{}", module.name);
            assert_eq!(records.last().map(|last| (last + 1) * RECORD), Some(store_size(module)), "{}", module.name);
        }
    }

    #[test]
    fn memory_of_equal_bytes_holds_nothing() {
        for byte in [0, 0xff] {
            let mut eeprom = filled(byte);
            assert!(keys(&TMCM_3351).all(|key| eeprom.load(key).is_none()), "bytes of {byte}");
        }
    }

    #[test]
    fn flipped_bit_gives_back_the_value_before() {
        let (old, new) = ([1, 2, 3, 4, 5, 6, 7], [0xff, 0, 0x80, 0x7f, 9, 8, 7]);
        for bit in 0..8 * SLOT {
            let mut eeprom = filled(0);
            eeprom.save(Key::Program(3), old);
            eeprom.save(Key::Program(3), new);
            let newer = eeprom.slots(Key::Program(3)).0.address;
            eeprom.store.0[(newer + bit / 8) as usize] ^= 1 << (bit % 8);
            assert_eq!(eeprom.load(Key::Program(3)), Some(old), "bit {bit}");
        }
    }

    #[test]
    fn latest_of_many_writes_is_read() {
        let mut eeprom = filled(0xff);
        for value in -50..50 {
            eeprom.save_value(Key::Variable(7), value);
            assert_eq!(eeprom.load_value(Key::Variable(7)), Some(value));
        }
        eeprom.clear(Key::Variable(7));
        assert_eq!(eeprom.load_value(Key::Variable(7)), None);
        eeprom.save_value(Key::Variable(7), 9);
        assert_eq!(eeprom.load_value(Key::Variable(7)), Some(9));
    }
}
