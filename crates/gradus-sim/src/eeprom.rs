//! Simulated EEPROM, in memory or in a file.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use gradus_firmware::{Store, store_size};
use gradus_tmcl::catalogue::Module;

/// What can go wrong with an EEPROM file.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // the messages say it
pub enum EepromError {
    #[error("cannot open the EEPROM file {path}")]
    Open { path: PathBuf, source: io::Error },
    #[error("the EEPROM file {path} is in use by another simulator; choose another file")]
    InUse { path: PathBuf },
    #[error("{path} has {found} bytes, the EEPROM of this module {expected}: it is not an EEPROM file of this module")]
    Size { path: PathBuf, found: u64, expected: u64 },
    #[error("cannot write the EEPROM file {path}")]
    Write { path: PathBuf, source: io::Error },
    #[error(
        "another program has cut the EEPROM file {path} to {found} of {expected} bytes; what was stored in the rest is lost"
    )]
    Cut { path: PathBuf, found: u64, expected: u64 },
}

/// Bytes of a page.
const PAGE: usize = 32;

/// An EEPROM that counts the writes of each page of 32 bytes.
///
/// A copy is in memory alone, and shares the pages that neither has written since: copying costs microseconds.
///
/// With a file behind it every byte is in the file before [`Store::write`] returns: a killed simulator loses nothing, and
/// [`sync`](Self::sync) keeps it even from a power cut of the computer.
#[derive(Debug)]
pub struct Eeprom {
    pages: Vec<Arc<Page>>,
    /// Bytes.
    size: usize,
    /// Writes until the power fails.
    writes_left: Option<u64>,
    file: Option<Backing>,
}

#[derive(Clone, Debug)]
struct Page {
    bytes: [u8; PAGE],
    writes: u32,
}

#[derive(Debug)]
struct Backing {
    file: File,
    path: PathBuf,
    /// Bytes of the file, as long as nobody else changes it.
    size: u64,
    failure: Option<EepromError>,
}

impl Clone for Eeprom {
    fn clone(&self) -> Self {
        Self { pages: self.pages.clone(), size: self.size, writes_left: self.writes_left, file: None }
    }
}

fn size_for(module: &Module) -> usize {
    store_size(module) as usize
}

impl Eeprom {
    /// An erased EEPROM in memory, as large as the module needs.
    pub fn of(module: &Module) -> Self {
        Self::new(size_for(module))
    }

    pub(crate) fn new(size: usize) -> Self {
        // Each page has memory of its own from the start: a write to an EEPROM that nobody has copied allocates nothing.
        let erased = |_| Arc::new(Page { bytes: [0xff; PAGE], writes: 0 });
        Self { pages: (0..size.div_ceil(PAGE)).map(erased).collect(), size, writes_left: None, file: None }
    }

    /// An EEPROM in memory that holds these bytes already.
    pub fn with_cells(cells: &[u8]) -> Self {
        let page = |cells: &[u8]| {
            let mut bytes = [0xff; PAGE];
            bytes[..cells.len()].copy_from_slice(cells);
            Arc::new(Page { bytes, writes: 0 })
        };
        Self { pages: cells.chunks(PAGE).map(page).collect(), ..Self::new(cells.len()) }
    }

    /// The module's EEPROM in a file, which is created if it does not exist. No other process can open it meanwhile.
    ///
    /// # Errors
    /// When the file cannot be opened, is in use, or has another size.
    pub fn open(path: &Path, module: &Module) -> Result<Self, EepromError> {
        Self::open_file(path, size_for(module))
    }

    fn open_file(path: &Path, size: usize) -> Result<Self, EepromError> {
        let mut file = open_locked(path)?;
        let cells = read_cells(&mut file, path, size)?;
        let backing = Backing { file, path: path.to_owned(), size: size as u64, failure: None };
        Ok(Self { file: Some(backing), ..Self::with_cells(&cells) })
    }

    /// Returns what the cells hold.
    pub fn cells(&self) -> Vec<u8> {
        let mut cells: Vec<u8> = self.pages.iter().flat_map(|page| page.bytes).collect();
        cells.truncate(self.size);
        cells
    }

    /// Returns how many bytes have been written to the page of an address; 0 past the end.
    pub fn writes(&self, address: u32) -> u32 {
        self.pages.get(address as usize / PAGE).map_or(0, |page| page.writes)
    }

    /// Returns how many bytes have been written to all pages together.
    pub fn total_writes(&self) -> u64 {
        self.pages.iter().map(|page| u64::from(page.writes)).sum()
    }

    /// Cuts the power after so many writes from now on: later ones leave no trace. `None` gives it back.
    pub fn cut_power_after(&mut self, writes: Option<u64>) {
        self.writes_left = writes;
    }

    /// Fails if the file did not take a byte since the last call.
    ///
    /// # Errors
    /// The first failure.
    pub fn check(&mut self) -> Result<(), EepromError> {
        self.file.as_mut().and_then(|backing| backing.failure.take()).map_or(Ok(()), Err)
    }

    /// Waits until the file is on the disk.
    ///
    /// # Errors
    /// When the file cannot be written, or another program has cut it.
    pub fn sync(&mut self) -> Result<(), EepromError> {
        self.check()?;
        self.file.as_ref().map_or(Ok(()), Backing::sync)
    }

    /// True while there is power for another write.
    fn has_power(&mut self) -> bool {
        match &mut self.writes_left {
            Some(0) => false,
            Some(left) => {
                *left -= 1;
                true
            }
            None => true,
        }
    }
}

impl Store for Eeprom {
    fn read(&mut self, address: u32, bytes: &mut [u8]) {
        for (index, byte) in bytes.iter_mut().enumerate() {
            let index = (address as usize).saturating_add(index);
            *byte = self.pages.get(index / PAGE).map_or(0xff, |page| page.bytes[index % PAGE]);
        }
    }

    fn write(&mut self, address: u32, byte: u8) {
        let index = address as usize;
        if index >= self.size || !self.has_power() {
            return;
        }
        let page = Arc::make_mut(&mut self.pages[index / PAGE]);
        page.bytes[index % PAGE] = byte;
        page.writes += 1;
        if let Some(backing) = &mut self.file {
            backing.write(address, byte);
        }
    }
}

impl Backing {
    /// Writes a byte, unless another program has cut the file: it would be filled with zeros, and nobody would know.
    fn write(&mut self, address: u32, byte: u8) {
        if let Err(error) = self.whole().and_then(|()| self.put(address, byte)) {
            self.failure.get_or_insert(error);
        }
    }

    fn put(&mut self, address: u32, byte: u8) -> Result<(), EepromError> {
        let written = self.file.seek(SeekFrom::Start(address.into())).and_then(|_| self.file.write_all(&[byte]));
        written.map_err(|source| self.fail(source))
    }

    fn sync(&self) -> Result<(), EepromError> {
        self.whole()?;
        self.file.sync_all().map_err(|source| self.fail(source))
    }

    /// Fails if the file is shorter than it was.
    fn whole(&self) -> Result<(), EepromError> {
        let found = self.file.metadata().map_err(|source| self.fail(source))?.len();
        if found < self.size {
            return Err(EepromError::Cut { path: self.path.clone(), found, expected: self.size });
        }
        Ok(())
    }

    fn fail(&self, source: io::Error) -> EepromError {
        EepromError::Write { path: self.path.clone(), source }
    }
}

fn open_locked(path: &Path) -> Result<File, EepromError> {
    let fail = |source| EepromError::Open { path: path.to_owned(), source };
    let options = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
    let file = options.map_err(fail)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(EepromError::InUse { path: path.to_owned() }),
        Err(TryLockError::Error(source)) => Err(fail(source)),
    }
}

/// Reads the file; an empty one is new and gets its size in one step.
fn read_cells(file: &mut File, path: &Path, size: usize) -> Result<Vec<u8>, EepromError> {
    let fail = |source| EepromError::Open { path: path.to_owned(), source };
    let (found, expected) = (file.metadata().map_err(fail)?.len(), size as u64);
    if found == 0 {
        file.set_len(expected).map_err(fail)?;
    } else if found != expected {
        return Err(EepromError::Size { path: path.to_owned(), found, expected });
    }
    let mut cells = vec![0; size];
    file.read_exact(&mut cells).map_err(fail)?;
    Ok(cells)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// An EEPROM whose file takes no bytes.
    pub(crate) fn broken(size: usize) -> Eeprom {
        let path = PathBuf::from("/dev/null");
        let file = File::open(&path).unwrap();
        Eeprom { file: Some(Backing { file, path, size: 0, failure: None }), ..Eeprom::new(size) }
    }

    #[test]
    fn failed_write_is_reported_once() {
        let mut eeprom = broken(8);
        assert!(eeprom.check().is_ok());
        eeprom.write(0, 1);
        assert_eq!(eeprom.check().unwrap_err().to_string(), "cannot write the EEPROM file /dev/null");
        assert!(eeprom.check().is_ok());
    }

    fn read(eeprom: &mut Eeprom, address: u32) -> [u8; 2] {
        let mut bytes = [0; 2];
        eeprom.read(address, &mut bytes);
        bytes
    }

    #[test]
    fn cells_keep_and_count_what_is_written() {
        let mut eeprom = Eeprom::new(4);
        for byte in [1, 2, 3] {
            eeprom.write(1, byte);
        }
        eeprom.write(4, 9);
        assert_eq!(eeprom.cells(), [0xff, 3, 0xff, 0xff]);
        assert_eq!(([0, 1, 32].map(|address| eeprom.writes(address)), eeprom.total_writes()), ([3, 3, 0], 3));
    }

    #[test]
    fn copy_shares_what_neither_has_written() {
        let mut eeprom = Eeprom::new(100);
        eeprom.write(40, 1);
        let mut copy = eeprom.clone();
        copy.write(70, 2);
        eeprom.write(41, 3);
        assert_eq!((read(&mut copy, 40), read(&mut copy, 70)), ([1, 0xff], [2, 0xff]));
        assert_eq!((read(&mut eeprom, 40), read(&mut eeprom, 70)), ([1, 3], [0xff; 2]));
        assert!(Arc::ptr_eq(&eeprom.pages[0], &copy.pages[0]));
    }

    #[test]
    fn reading_past_the_end_gives_ones() {
        let mut eeprom = Eeprom::with_cells(&[0, 1]);
        assert_eq!([0, 1, 2, u32::MAX].map(|at| read(&mut eeprom, at)), [[0, 1], [1, 255], [255; 2], [255; 2]]);
    }

    #[test]
    fn writes_after_the_power_cut_leave_no_trace() {
        let mut eeprom = Eeprom::with_cells(&[0; 3]);
        eeprom.cut_power_after(Some(2));
        for address in 0..3 {
            eeprom.write(address, 7);
        }
        assert_eq!((eeprom.cells(), eeprom.total_writes()), (vec![7, 7, 0], 2));
        eeprom.cut_power_after(None);
        eeprom.write(2, 7);
        assert_eq!(eeprom.cells(), [7, 7, 7]);
    }

    #[test]
    fn file_holds_a_byte_as_soon_as_it_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("eeprom");
        let mut eeprom = Eeprom::open_file(&path, 8).unwrap();
        eeprom.write(3, 0x42);
        assert_eq!(std::fs::read(&path).unwrap(), [0, 0, 0, 0x42, 0, 0, 0, 0]);
        eeprom.sync().unwrap();
        drop(eeprom);
        assert_eq!(read(&mut Eeprom::open_file(&path, 8).unwrap(), 3), [0x42, 0]);
    }

    #[test]
    fn file_that_is_cut_while_in_use_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("eeprom");
        let mut eeprom = Eeprom::open_file(&path, 8).unwrap();
        eeprom.write(3, 0x42);
        std::fs::write(&path, [1, 2]).unwrap();
        eeprom.write(3, 0x43);
        let error = eeprom.check().unwrap_err();
        assert!(matches!(error, EepromError::Cut { found: 2, expected: 8, .. }), "{error}");
        assert!(matches!(eeprom.sync(), Err(EepromError::Cut { .. })), "at the end too, if nothing is written");
        assert_eq!(std::fs::read(&path).unwrap(), [1, 2], "the file is left alone");
    }

    #[test]
    fn second_simulator_cannot_open_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("eeprom");
        let _first = Eeprom::open_file(&path, 8).unwrap();
        assert!(matches!(Eeprom::open_file(&path, 8), Err(EepromError::InUse { .. })));
    }

    #[test]
    fn file_of_another_size_is_refused_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notes.txt");
        std::fs::write(&path, "dear diary").unwrap();
        let error = Eeprom::open_file(&path, 8).unwrap_err();
        assert!(matches!(error, EepromError::Size { found: 10, expected: 8, .. }), "{error}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "dear diary");
    }

    #[test]
    fn missing_folder_is_named() {
        let error = Eeprom::open_file(Path::new("/does/not/exist/eeprom"), 8).unwrap_err();
        assert_eq!(error.to_string(), "cannot open the EEPROM file /does/not/exist/eeprom");
    }
}
