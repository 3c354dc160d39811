//! Arguments that several subcommands have: the port and the module.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use gradus_host::{Session, Url};
use gradus_tmcl::catalogue::Module;

/// Where the module is.
#[derive(clap::Args)]
pub struct Port {
    /// Port of the module: sim:MODULE, tcp:HOST:PORT, serial:PATH?baud=9600 or a path, each with ?address=N.
    #[arg(long, value_name = "URL", default_value = "sim:tmcm-3351")]
    port: Url,
}

impl Port {
    /// Opens it.
    ///
    /// # Errors
    /// When it does not open or no module answers.
    pub fn open(&self) -> Result<Session, gradus_host::Error> {
        Session::open(&self.port)
    }
}

/// Takes the name of one of these modules.
pub fn module(modules: &'static [&'static Module]) -> impl TypedValueParser<Value = &'static Module> {
    let names = modules.iter().map(|module| module.name.to_lowercase());
    PossibleValuesParser::new(names).try_map(|name| Module::named(&name).ok_or("the catalogue has no such module"))
}
