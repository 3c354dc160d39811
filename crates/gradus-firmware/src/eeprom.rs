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
}

/// Bytes of memory that a module needs.
pub const fn store_size(catalogue: &Module) -> u32 {
    let coordinates = catalogue.coordinates as u32 * catalogue.axes as u32;
    let records =
        catalogue.program_len as u32 + catalogue.global_parameters.len() as u32 + STORED_VARIABLES as u32 + coordinates;
    records * RECORD
}

/// The records of a module in its [`Store`].
#[derive(Debug)]
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
        match key {
            Key::Program(address) => u32::from(address),
            Key::Global(row) => globals + row as u32,
            Key::Variable(number) => variables + u32::from(number),
            Key::Coordinate(number, axis) => {
                coordinates + u32::from(number) * u32::from(self.catalogue.axes) + axis as u32
            }
        }
    }
}

/// True for parameters that every write stores.
pub(crate) fn stored_at_once(access: Access) -> bool {
    access == Access::Rwa
}

/// Sequence number and CRC-6 (x^6 + x + 1) of the bytes. The start value makes a slot full of ones invalid.
fn header(sequence: u8, bytes: &[u8; 7]) -> u8 {
    let mut crc = 0x15_u8;
    for byte in bytes {
        for bit in (0..8).rev() {
            let carry = (crc >> 5 ^ byte >> bit) & 1;
            crc = (crc << 1 & 0x3f) ^ (carry * 0x03);
        }
    }
    sequence << 6 | crc
}
