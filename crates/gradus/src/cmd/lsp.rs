//! `gradus lsp`: the language server, for editors.

use std::collections::VecDeque;
use std::fs;
use std::io::{self, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver};
use std::thread;

use anyhow::{Context, bail};
use gradus_asm::{Code, LintOptions, Options};
use gradus_lab as lab;
use gradus_lsp::{Files, Project, Server};
use gradus_tmcl::catalogue::{Module, TMCM_3351};
use lsp_server::Message;

use crate::{complain, project};

/// Serve the language server protocol, for editors
///
/// Editors start it by themselves and talk to it on standard input and output. It reports problems while a program is written,
/// and serves completion, hover, signature help, definitions, references, renaming, outline, formatting, fixes and more. The
/// module of a program is that of its pragma `// gradus: module NAME`, of the nearest `gradus.toml`, or the TMCM-3351.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus lsp                            as an editor starts it
  gradus lsp --tcp 127.0.0.1:9257       for an editor that connects by TCP")]
pub struct Lsp {
    /// Talk on standard input and output; the default
    #[arg(long, conflicts_with = "tcp")]
    #[allow(dead_code)] // names the default
    stdio: bool,
    /// Listen on a TCP port in place of standard input and output, for one editor
    #[arg(long, value_name = "ADDR:PORT")]
    tcp: Option<SocketAddr>,
}

impl Lsp {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let status = match self.tcp {
            None => serve(io::stdin(), out)?,
            Some(address) => {
                let listener = TcpListener::bind(address).with_context(|| format!("cannot listen on {address}"))?;
                complain(format_args!("lsp {}", listener.local_addr()?));
                let (mut editor, _) = listener.accept()?;
                serve(editor.try_clone()?, &mut editor)?
            }
        };
        match status {
            Some(0) => Ok(()),
            Some(_) => bail!("the editor ended the conversation without `shutdown`"),
            None => bail!("the editor has gone without `exit`"),
        }
    }
}

/// Talks until the client ends the conversation; returns the exit status it asks for, `None` if it has just gone.
///
/// All messages that wait are taken before anything is analysed: however fast somebody types, the last state counts.
fn serve(input: impl Read + Send + 'static, out: &mut dyn Write) -> anyhow::Result<Option<i32>> {
    let inbox = read(input);
    let mut server = Server::new(Box::new(Disk));
    while let Ok(first) = inbox.recv() {
        for message in std::iter::once(first).chain(inbox.try_iter()) {
            send(out, server.receive(message?))?;
            if let Some(status) = server.exit_status() {
                return Ok(Some(status));
            }
        }
        send(out, server.settle())?;
    }
    Ok(None)
}

fn send(mut out: &mut dyn Write, messages: Vec<Message>) -> io::Result<()> {
    messages.into_iter().try_for_each(|message| message.write(&mut out))
}

/// Reads messages in a thread of its own, until the input ends or is no message.
fn read(input: impl Read + Send + 'static) -> Receiver<anyhow::Result<Message>> {
    let (sender, inbox) = mpsc::channel();
    thread::spawn(move || {
        let mut input = BufReader::new(input);
        while let Some(message) = Message::read(&mut input).context("what the editor sends is no message").transpose() {
            let is_last = message.is_err();
            if sender.send(message).is_err() || is_last {
                break;
            }
        }
    });
    inbox
}

/// The files of this computer.
struct Disk;

/// Folders that hold no programs of a user.
const LEFT_OUT: &[&str] = &["target", "node_modules"];

impl Files for Disk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        fs::read(path)
    }

    /// Looks into folders breadth first, so that the nearest programs are among the first.
    fn programs(&self, folder: &Path, most: usize) -> Vec<PathBuf> {
        const FOLDERS: usize = 5000;
        let (mut waiting, mut found, mut seen) = (VecDeque::from([folder.to_owned()]), Vec::new(), 0);
        while let Some(folder) = waiting.pop_front() {
            seen += 1;
            if found.len() >= most || seen > FOLDERS {
                break;
            }
            let Ok(entries) = fs::read_dir(&folder) else { continue };
            for entry in entries.flatten() {
                let path = entry.path();
                match entry.file_type() {
                    Ok(kind) if kind.is_dir() && is_searched(&path) => waiting.push_back(path),
                    Ok(kind) if kind.is_file() && is_program(&path) => found.push(path),
                    _ => {}
                }
            }
        }
        found.truncate(most);
        found
    }

    fn project(&self, program: &Path) -> Project {
        let folder = program.parent().unwrap_or(Path::new(""));
        let Ok(Some(file)) = lab::Project::find(folder) else {
            return Project { module: &TMCM_3351, options: Options::default(), lint: LintOptions::default() };
        };
        let module = file.module.as_deref().and_then(|name| self.module(name)).unwrap_or(&TMCM_3351);
        let allow = file.lint.allow.iter().filter_map(|code| Code::named(code)).collect();
        let options = Options { include_dirs: file.include, constants: file.defines, ..Options::default() };
        Project { module, options, lint: LintOptions { allow, ..LintOptions::default() } }
    }

    fn module(&self, name: &str) -> Option<&'static Module> {
        project::named(name)
    }
}

fn is_searched(folder: &Path) -> bool {
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    !name.starts_with('.') && !LEFT_OUT.contains(&&*name)
}

fn is_program(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("tmc"))
}
