use std::io::Read;

use gradus_tmcl::catalogue::TMCM_3351;

use super::*;
use crate::eeprom::tests::broken;
use crate::{Bench, Machine};

#[test]
fn endpoint_of_another_kind_of_bus_is_refused() {
    let endpoint = Endpoint::SlcanPty(None);
    let error = Server::open(Bench::with_defaults(&TMCM_3351), &[endpoint], Options::default()).unwrap_err();
    assert_eq!(error.to_string(), "slcan does not fit the bus usb; a serial line has the endpoints pty and tcp");
}

#[test]
fn value_that_cannot_be_stored_is_never_acknowledged() {
    let bench = Bench::new(&TMCM_3351, Machine::of(&TMCM_3351), broken(200_000));
    let any_port = Endpoint::Tcp("127.0.0.1:0".parse().unwrap());
    let mut server = Server::open(bench, &[any_port], Options::default()).unwrap();
    let Endpoint::Tcp(address) = server.endpoints()[0] else { panic!("not TCP") };
    let mut host = TcpStream::connect(address).unwrap();
    host.write_all(&[1, 9, 77, 0, 0, 0, 0, 1, 88]).unwrap(); // SGP 77, 0, 1
    let error = server.run(None).unwrap_err();
    assert!(matches!(error, ServeError::Eeprom(_)), "{error}");
    drop(server);
    let mut reply = Vec::new();
    host.read_to_end(&mut reply).unwrap();
    assert_eq!(reply, []);
}
