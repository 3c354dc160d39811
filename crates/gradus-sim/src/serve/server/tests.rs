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

#[test]
fn lag_of_more_than_a_tenth_of_a_second_is_given_up_and_less_is_made_good() {
    let mut server = Server::open(Bench::with_defaults(&TMCM_3351), &[], Options::default()).unwrap();
    let wall = Instant::now() + Duration::from_secs(3600);
    for (lag, left_us) in [(Duration::from_secs(10), 100_000), (MAX_LAG, 100_000), (Duration::from_millis(60), 60_000)]
    {
        server.pace.restart(wall.checked_sub(lag).unwrap(), server.rig.now());
        server.give_up_lag(wall);
        assert_eq!(server.pace.virtual_at(wall) - server.rig.now(), left_us, "{lag:?}");
    }
}
