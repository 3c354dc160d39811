//! A serial port for one program alone.
//!
//! Two programs on one port take each other's answers. A [`Claim`] is a lock (flock) on the device file, which pyserial, picocom and
//! others look at too, taken before any setting of the port is touched; and on a port that is no pseudo-terminal TIOCEXCL,
//! which keeps programs out that do not look. On a pseudo-terminal that flag would outlive a killed program.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::Path;

use rustix::fs::{FlockOperation, OFlags, flock};
use rustix::io::Errno;
use rustix::termios::ioctl_tiocexcl;

/// The port is this program's while it lives.
pub struct Claim {
    file: File,
    is_pseudo: bool,
}

impl Claim {
    /// Takes the port, unless another program has it.
    ///
    /// # Errors
    /// Why not, in words, as far as this is about who may use it; other failures of opening as they are.
    pub fn take(path: &Path) -> Result<Self, Refusal> {
        let flags = (OFlags::NONBLOCK | OFlags::NOCTTY).bits();
        let file = OpenOptions::new().read(true).write(true).custom_flags(flags as i32).open(path);
        let file = file.map_err(|error| refusal(path, error))?;
        // What knows no locks is no serial port; opening it says so.
        if flock(&file, FlockOperation::NonBlockingLockExclusive) == Err(Errno::WOULDBLOCK) {
            return Err(Refusal::Words(in_use(path)));
        }
        let is_pseudo = path.canonicalize().is_ok_and(|path| path.starts_with("/dev/pts"));
        Ok(Self { file, is_pseudo })
    }

    /// Keeps out programs that do not look at the lock.
    pub fn keep_others_out(&self) {
        if !self.is_pseudo {
            let _ = ioctl_tiocexcl(&self.file); // the lock holds all the same
        }
    }
}

/// Why a port cannot be had.
pub enum Refusal {
    /// In words.
    Words(String),
    /// As the system says it.
    System(io::Error),
}

fn refusal(path: &Path, error: io::Error) -> Refusal {
    match error.kind() {
        io::ErrorKind::ResourceBusy => Refusal::Words(in_use(path)),
        io::ErrorKind::PermissionDenied => {
            let group = fs::metadata(path).ok().and_then(|file| group(file.gid()));
            Refusal::Words(permission_denied(path, group.as_deref()))
        }
        _ => Refusal::System(error),
    }
}

/// Words for a port that another program has.
fn in_use(path: &Path) -> String {
    let who = owner(path).unwrap_or_else(|| "another program".into());
    format!("in use by {who}; see `gradus serve`, which shares a port between programs")
}

/// Number and name of a program that has the file open, if this one may know.
fn owner(path: &Path) -> Option<String> {
    let device = path.canonicalize().ok()?;
    let programs = fs::read_dir("/proc").ok()?.flatten().map(|entry| entry.path());
    let mut holders = programs.filter(|program| has_open(program, &device)).filter_map(|program| name(&program));
    let own = std::process::id().to_string();
    let first = holders.next()?;
    // This program has the file open too, having just tried; it is named only if it is the one.
    let is_own = first.split(' ').next() == Some(own.as_str());
    Some(if is_own { holders.next().unwrap_or(first) } else { first })
}

fn has_open(program: &Path, device: &Path) -> bool {
    let files = fs::read_dir(program.join("fd")).into_iter().flatten().flatten();
    files.filter_map(|file| fs::read_link(file.path()).ok()).any(|target| target == device)
}

fn name(program: &Path) -> Option<String> {
    let number = program.file_name()?.to_str()?.parse::<u32>().ok()?;
    let name = fs::read_to_string(program.join("comm")).unwrap_or_default();
    Some(format!("{number} {}", name.trim()).trim().into())
}

/// Name of a group, as `/etc/group` has it.
fn group(number: u32) -> Option<String> {
    let groups = fs::read_to_string("/etc/group").ok()?;
    let line = groups.lines().find(|line| line.split(':').nth(2) == Some(&number.to_string()))?;
    line.split(':').next().map(Into::into)
}

fn permission_denied(path: &Path, group: Option<&str>) -> String {
    let group = group.unwrap_or("dialout");
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let kernel = file.trim_end_matches(|c: char| c.is_ascii_digit());
    format!(
        "permission denied; add yourself to its group, `sudo usermod -aG {group} $USER`, and log in again; or give it to whoever \
         sits at this computer by a line in /etc/udev/rules.d/60-gradus.rules: KERNEL==\"{kernel}[0-9]*\", TAG+=\"uaccess\""
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn permission_denied_names_the_group_and_the_rule() {
        let words = permission_denied(Path::new("/dev/ttyUSB0"), Some("uucp"));
        assert!(words.contains("usermod -aG uucp"), "{words}");
        assert!(words.ends_with(r#"rules.d/60-gradus.rules: KERNEL=="ttyUSB[0-9]*", TAG+="uaccess""#), "{words}");
        let error = io::Error::from(io::ErrorKind::PermissionDenied);
        let Refusal::Words(words) = refusal(Path::new("/etc/passwd"), error) else { panic!("no words") };
        assert!(words.contains("usermod -aG root"), "{words}");
    }

    #[test]
    fn a_port_that_the_system_keeps_for_another_program_is_in_use() {
        let error = io::Error::from(io::ErrorKind::ResourceBusy);
        let Refusal::Words(words) = refusal(Path::new("/dev/no-such-port"), error) else { panic!("no words") };
        assert!(words.starts_with("in use by another program; see `gradus serve`"), "{words}");
    }

    #[test]
    fn a_second_claim_names_who_has_the_port() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let claim = Claim::take(file.path());
        assert!(claim.is_ok());
        let Err(Refusal::Words(words)) = Claim::take(file.path()) else { panic!("taken twice") };
        let own = std::process::id();
        assert!(words.starts_with(&format!("in use by {own} ")) && words.contains("gradus serve"), "{words}");
        drop(claim);
        assert!(Claim::take(file.path()).is_ok());
    }
}
