//! A module on its machine, in virtual time.

use std::collections::VecDeque;

use gradus_firmware::{LineRates, Link, LinkKind, ProgramView, Register};
use gradus_plant::{Readings, STEP_US};
use gradus_tmcl::catalogue::{self, Ap, Gp, TMCM_351, TMCM_1617, TMCM_3351};
use gradus_tmcl::rates::{BAUD_RATES, CAN_BIT_RATES};
use gradus_tmcl::{Instruction, Opcode, Reply, Request, can};

use crate::console::Change;
use crate::notices::{self, Notice, Notices};
use crate::{Eeprom, Firmware, Machine};

/// The modules whose firmware really runs; the others are in the catalogue only.
pub static VIRTUAL_MODULES: &[&catalogue::Module] = &[&TMCM_3351, &TMCM_351, &TMCM_1617];

/// Whether the firmware of a module runs.
pub fn is_virtual(module: &catalogue::Module) -> bool {
    VIRTUAL_MODULES.iter().any(|known| known.model == module.model)
}

/// The names of [`VIRTUAL_MODULES`], for messages.
pub fn virtual_names() -> String {
    VIRTUAL_MODULES.iter().map(|module| module.name.to_lowercase()).collect::<Vec<_>>().join(", ")
}

/// One module with its machine, in virtual time: microseconds since the bench was built.
///
/// Nothing happens unless time is moved with [`run_until`](Self::run_until). Two benches that get the same calls are equal
/// to the bit, and a copy is independent of its original and goes on alike. What is to happen to the machine later can be [scheduled](Self::schedule).
///
/// ```
/// use gradus_sim::{Bench, LinkKind};
/// use gradus_tmcl::catalogue::{Ap, TMCM_3351};
///
/// let mut bench = Bench::with_defaults(&TMCM_3351);
/// let mut link = bench.attach(LinkKind::Usb, 0);
/// bench.send(&mut link, &[1, 4, 0, 0, 0, 0, 0xc8, 0, 0xcd]); // MVP ABS, 0, 51200
/// assert_eq!(bench.take(&mut link), Some([2, 1, 100, 4, 0, 0, 0xc8, 0, 0x33]));
/// bench.run_for(3_000_000);
/// assert_eq!(bench.axis_parameter(0, Ap::ActualPosition), Some(51_200));
/// ```
#[derive(Clone, Debug)]
pub struct Bench {
    catalogue: &'static catalogue::Module,
    now_us: u64,
    board: Board,
    /// Changes to come with their times in microseconds, in the order of time.
    schedule: VecDeque<(u64, Change)>,
    links: u32,
    /// Since when the module does nothing although it has power.
    hung_since_us: Option<u64>,
    notices: Notices,
    /// The supply of the module is switched on; it may be too low.
    switched_on: bool,
}

/// The board with and without power. The firmware's time starts anew with the power.
#[derive(Clone, Debug)]
enum Board {
    On { firmware: Firmware, since_us: u64 },
    Off(Box<(Machine, Eeprom)>),
}

impl Bench {
    /// Puts a module on a machine and switches it on.
    pub fn new(catalogue: &'static catalogue::Module, mut machine: Machine, eeprom: Eeprom) -> Self {
        machine.fit(catalogue);
        let board = Board::On { firmware: Firmware::new(catalogue, machine, eeprom), since_us: 0 };
        let mut bench = Self {
            catalogue,
            now_us: 0,
            board,
            schedule: VecDeque::new(),
            links: 0,
            hung_since_us: None,
            notices: Notices::default(),
            switched_on: true,
        };
        bench.watch_supply();
        bench
    }

    /// A module with an erased EEPROM on a machine of default motors without switches.
    pub fn with_defaults(catalogue: &'static catalogue::Module) -> Self {
        Self::new(catalogue, Machine::of(catalogue), Eeprom::of(catalogue))
    }

    /// The same with axes that never lose a step: exact, and without cost while they rest.
    pub fn rigid(catalogue: &'static catalogue::Module) -> Self {
        Self::new(catalogue, Machine::rigid(catalogue), Eeprom::of(catalogue))
    }

    /// The module's tables.
    pub fn catalogue(&self) -> &'static catalogue::Module {
        self.catalogue
    }
}

// Time.
impl Bench {
    /// Virtual time in microseconds.
    pub fn now(&self) -> u64 {
        self.now_us
    }

    /// When something happens next if nobody does anything; `None`: never, or not before the power is back.
    pub fn next_event(&self) -> Option<u64> {
        let change = self.schedule.front().map(|(at_us, _)| *at_us);
        let step = self.machine_ref().is_awake().then(|| next_step(self.now_us));
        let next = [self.next_of_board(), change, step].into_iter().flatten().min();
        next.map(|at_us| at_us.max(self.now_us))
    }

    fn next_of_board(&self) -> Option<u64> {
        match &self.board {
            Board::On { firmware, since_us } if self.hung_since_us.is_none() => {
                firmware.poll_at().map(|at| since_us.saturating_add(at))
            }
            _ => None,
        }
    }

    /// Lets a change happen at a time in microseconds: after what the module does at that time, and after the changes
    /// that have been scheduled for it before. A time that has passed means now.
    pub fn schedule(&mut self, at_us: u64, change: Change) {
        let at_us = at_us.max(self.now_us);
        let index = self.schedule.partition_point(|(other_us, _)| *other_us <= at_us);
        self.schedule.insert(index, (at_us, change));
    }

    /// Moves time on to `end_us`; a time that has passed changes nothing.
    pub fn run_until(&mut self, end_us: u64) {
        let end_us = end_us.max(self.now_us);
        while let Some((at_us, change)) = self.schedule.pop_front_if(|(at_us, _)| *at_us <= end_us) {
            self.pass(at_us);
            change.apply(self);
            self.machine().wake();
            self.pass(at_us);
        }
        self.pass(end_us);
    }

    /// Lets module and machine do all that is due up to `end_us`, during which nothing changes from outside.
    ///
    /// The motors take a step at every multiple of 100 us while one of them is awake. Up to there the module sees them as
    /// they were after the step before; what it does at that very time comes after the step.
    fn pass(&mut self, end_us: u64) {
        self.watch_supply();
        while let Some(step_us) = self.next_of_machine().filter(|step_us| *step_us <= end_us) {
            self.poll(step_us - 1);
            self.machine().advance(step_us);
            self.now_us = step_us;
        }
        self.now_us = end_us;
        self.poll(end_us);
    }

    fn poll(&mut self, to_us: u64) {
        if let Board::On { firmware, since_us } = &mut self.board
            && self.hung_since_us.is_none()
        {
            firmware.poll(to_us.saturating_sub(*since_us));
            self.notices.look(to_us, firmware);
        }
    }

    /// When the motors take their next step: while all of them sleep, not before the module has done something.
    fn next_of_machine(&self) -> Option<u64> {
        let machine = self.machine_ref();
        if machine.is_awake() {
            return Some(next_step(self.now_us));
        }
        let due_us = self.next_of_board().filter(|_| machine.lives())?;
        Some(next_step(due_us.max(self.now_us)))
    }

    /// Moves time on by so many microseconds.
    pub fn run_for(&mut self, us: u64) {
        self.run_until(self.now_us.saturating_add(us));
    }
}

// Links.
impl Bench {
    /// Connects a new client. A pause of more than `gap_us` microseconds inside a datagram throws its beginning away; 0
    /// switches that off.
    pub fn attach(&mut self, kind: LinkKind, gap_us: u32) -> Link {
        Link::new(self.new_link_id(), kind, gap_us)
    }

    /// A number for a link that no other link has.
    pub(crate) fn new_link_id(&mut self) -> u32 {
        self.links = self.links.wrapping_add(1);
        self.links
    }

    /// Sends bytes to the module at this moment and says how many it has taken: fewer when replies wait to be
    /// [taken](Self::take), all when there is no power.
    pub fn send(&mut self, link: &mut Link, bytes: &[u8]) -> usize {
        self.running().map_or(bytes.len(), |firmware| firmware.receive(link, bytes))
    }

    /// The next reply or event for the client that may go over the line at this moment.
    #[inline]
    pub fn take(&mut self, link: &mut Link) -> Option<[u8; 9]> {
        self.running()?.transmit(link)
    }

    /// The next byte besides datagrams for the client that may go over the line at this moment: text of the ASCII interface, or
    /// samples of a bulk download.
    #[inline]
    pub fn take_byte(&mut self, link: &mut Link) -> Option<u8> {
        match &mut self.board {
            Board::On { firmware, .. } => firmware.transmit_byte(link),
            Board::Off(_) => None,
        }
    }

    /// Hands the module a frame of its CAN bus at this moment; without power it is lost.
    pub fn send_frame(&mut self, link: &mut Link, frame: &can::Frame) {
        if let Some(firmware) = self.running() {
            firmware.receive_frame(link, frame);
        }
    }

    /// The next reply or event for the CAN bus.
    pub fn take_frame(&mut self, link: &mut Link) -> Option<can::Frame> {
        self.running()?.transmit_frame(link)
    }

    /// When the next waiting reply of the client may go over the line, if one waits.
    pub fn ready_at(&self, link: &Link) -> Option<u64> {
        match &self.board {
            Board::On { since_us, .. } if self.hung_since_us.is_none() => {
                link.ready_at().map(|at| since_us.saturating_add(at))
            }
            _ => None,
        }
    }
}

// Power.
impl Bench {
    /// True while the module has power.
    pub fn has_power(&self) -> bool {
        matches!(self.board, Board::On { .. })
    }

    /// Lets the module hang: it does and hears nothing, its currents and outputs stay as they are. Afterwards it goes on as if
    /// no time had passed; a [`reset`](Self::reset) ends it too.
    pub fn hang(&mut self, on: bool) {
        let since = self.hung_since_us.take();
        match &mut self.board {
            Board::On { .. } if on => self.hung_since_us = since.or(Some(self.now_us)),
            Board::On { since_us, .. } => *since_us += since.map_or(0, |hung_us| self.now_us - hung_us),
            Board::Off(_) => {}
        }
    }

    /// Starts the module anew, as its watchdog would: the RAM is lost. Without effect if the power is off.
    pub fn reset(&mut self) {
        if self.has_power() {
            self.power_off();
            self.power_on();
        }
    }

    /// The reset to factory settings by the hardware: the module is switched off, and on again with bridged pads. It starts without
    /// any setting; a program stays, unless it is protected.
    pub fn reset_to_factory(&mut self) {
        self.power_off();
        self.power_on();
        if let Some(firmware) = self.running() {
            firmware.reset_to_factory();
        }
    }

    /// The firmware while it has power and does not hang.
    #[inline]
    fn running(&mut self) -> Option<&mut Firmware> {
        match &mut self.board {
            Board::On { firmware, .. } if self.hung_since_us.is_none() => Some(firmware),
            _ => None,
        }
    }

    /// True while the supply is switched on, be it too low for the module or not.
    pub fn is_switched_on(&self) -> bool {
        self.switched_on
    }

    /// A supply below the least that the module runs with is none; with enough of it the module starts anew.
    fn watch_supply(&mut self) {
        let suffices = self.machine_ref().io.surroundings.supply_v >= f64::from(self.catalogue.least_supply_v);
        match (suffices && self.switched_on, self.has_power()) {
            (false, true) => self.stop_board(),
            (true, false) => self.start_board(),
            _ => {}
        }
    }

    /// Cuts the power: the RAM is lost, the motors are without current, the outputs low. Without effect if it is off.
    pub fn power_off(&mut self) {
        self.switched_on = false;
        self.watch_supply();
    }

    /// Gives the power back: the module starts with what its EEPROM holds. Without effect if it is on, and as long as the supply
    /// is too low.
    pub fn power_on(&mut self) {
        self.switched_on = true;
        self.watch_supply();
    }

    fn stop_board(&mut self) {
        self.hung_since_us = None;
        self.replace_board(|board| match board {
            Board::On { firmware, .. } => {
                let (mut machine, eeprom) = firmware.into_parts();
                machine.lose_power();
                Board::Off(Box::new((machine, eeprom)))
            }
            off @ Board::Off(_) => off,
        });
    }

    fn start_board(&mut self) {
        let (catalogue, since_us) = (self.catalogue, self.now_us);
        self.replace_board(|board| match board {
            Board::Off(parts) => {
                let (machine, eeprom) = *parts;
                Board::On { firmware: Firmware::new(catalogue, machine, eeprom), since_us }
            }
            on @ Board::On { .. } => on,
        });
    }

    fn replace_board(&mut self, replace: impl FnOnce(Board) -> Board) {
        let nothing = Board::Off(Box::new((Machine::default(), Eeprom::new(0))));
        self.board = replace(std::mem::replace(&mut self.board, nothing));
    }
}

// What a bench looks at and changes.
impl Bench {
    /// The machine: plants, inputs, outputs.
    pub fn machine(&mut self) -> &mut Machine {
        match &mut self.board {
            Board::On { firmware, .. } => firmware.machine(),
            Board::Off(parts) => &mut parts.0,
        }
    }

    /// What instruments on the machine of an axis show at this moment; `None` if there is no such axis.
    pub fn readings(&self, axis: usize) -> Option<Readings> {
        let machine = self.machine_ref();
        Some(machine.axes.get(axis)?.plant.readings(self.now_us, &machine.io.surroundings))
    }

    fn machine_ref(&self) -> &Machine {
        match &self.board {
            Board::On { firmware, .. } => firmware.machine_ref(),
            Board::Off(parts) => &parts.0,
        }
    }

    /// The memory of the module.
    pub fn eeprom(&mut self) -> &mut Eeprom {
        match &mut self.board {
            Board::On { firmware, .. } => firmware.store(),
            Board::Off(parts) => &mut parts.1,
        }
    }

    /// The firmware, `None` without power.
    pub fn firmware(&mut self) -> Option<&mut Firmware> {
        match &mut self.board {
            Board::On { firmware, .. } => Some(firmware),
            Board::Off(_) => None,
        }
    }

    /// Sets a global parameter of bank 0 as SGP does, stored at once where SGP stores it; false without power and if the
    /// module refuses.
    pub fn set_global(&mut self, id: Gp, value: i32) -> bool {
        let Some(row) = self.catalogue.global_parameters.iter().find(|row| row.id == id) else { return false };
        let mut link = self.attach(LinkKind::Usb, 0);
        let instruction = Instruction { opcode: Opcode::SGP, kind: row.first, motor: row.bank, value };
        self.send(&mut link, &Request { address: 0, instruction }.emit());
        self.take(&mut link).and_then(|reply| Reply::parse(&reply).ok()).is_some_and(|reply| reply.status.is_ok())
    }

    /// Sets the rate of a line, global parameter 65 or 69, in bits a second, and starts the module with it if it has another one. False
    /// without power, when the module does not know the rate, and when its EEPROM is locked.
    pub fn set_rate(&mut self, id: Gp, rate: u32) -> bool {
        let Some(value) = rate_value(self.catalogue, id, rate) else { return false };
        if self.running().is_some_and(|firmware| rate_of(firmware.line_rates(), id) == rate) {
            return true;
        }
        let is_set = self.set_global(id, value);
        self.reset();
        is_set
    }

    /// Returns the bits a second of the lines, which the module has chosen at its latest start; `None` without power.
    pub fn line_rates(&self) -> Option<LineRates> {
        match &self.board {
            Board::On { firmware, .. } => Some(firmware.line_rates()),
            Board::Off(_) => None,
        }
    }

    /// Returns the stored program and the state of its interpreter, to look at; `None` without power. Times in it count
    /// from [`since_us`](Self::since_us).
    pub fn program(&self) -> Option<ProgramView<'_>> {
        match &self.board {
            Board::On { firmware, .. } => Some(firmware.program_view()),
            Board::Off(_) => None,
        }
    }

    /// Returns when the module was switched on: its own time counts from there.
    pub fn since_us(&self) -> Option<u64> {
        match &self.board {
            Board::On { since_us, .. } => Some(*since_us),
            Board::Off(_) => None,
        }
    }

    /// Sets a register of the program; false without power and for a program counter past the end of memory.
    pub fn set_program(&mut self, register: Register, value: i32) -> bool {
        self.firmware().is_some_and(|firmware| firmware.set_register(register, value))
    }

    /// What has happened by itself since the last call: a drive that has been switched off, a reference search that has failed.
    pub fn take_notices(&mut self) -> Vec<Notice> {
        if self.notices.is_empty() { Vec::new() } else { self.notices.take() }
    }

    /// What keeps the driver of a servo module off, with what to do; nothing of other modules.
    pub fn why_off(&mut self) -> Vec<String> {
        self.firmware().map_or_else(Vec::new, notices::why_off)
    }

    /// An axis parameter as GAP reads it; `None` without power and for what the module lacks.
    pub fn axis_parameter(&mut self, axis: usize, id: Ap) -> Option<i32> {
        self.firmware()?.get_axis(axis, id)
    }
}

/// The step of the motors that ends next after a time.
fn next_step(time_us: u64) -> u64 {
    (time_us / STEP_US).saturating_add(1).saturating_mul(STEP_US)
}

fn rate_of(rates: LineRates, id: Gp) -> u32 {
    if id == Gp::CanBitRate { rates.can } else { rates.baud }
}

/// The value of global parameter 65 or 69 for a rate in bits a second, if the module has it.
pub(crate) fn rate_value(catalogue: &catalogue::Module, id: Gp, rate: u32) -> Option<i32> {
    let rates = if id == Gp::CanBitRate { CAN_BIT_RATES.as_slice() } else { &BAUD_RATES };
    let value = rates.iter().position(|known| *known == rate)? as i32;
    let row = catalogue.global_parameters.iter().find(|row| row.id == id)?;
    row.accepts(value).then_some(value)
}

#[cfg(test)]
mod tests {
    use gradus_firmware::ProgramState;
    use gradus_plant::{Mechanics, Travel, Vane};
    use gradus_tmcl::Status;
    use gradus_tmcl::catalogue::TMCM_3351;

    use super::*;

    /// A bench with a host that sends one command at a time.
    struct Host {
        bench: Bench,
        link: Link,
    }

    impl Host {
        fn new() -> Self {
            Self::at(Bench::rigid(&TMCM_3351))
        }

        fn at(mut bench: Bench) -> Self {
            let link = bench.attach(LinkKind::Usb, 0);
            Self { bench, link }
        }

        fn ask(&mut self, opcode: Opcode, kind: u8, motor: u8, value: i32) -> Option<(Status, i32)> {
            let instruction = Instruction { opcode, kind, motor, value };
            self.bench.send(&mut self.link, &Request { address: 1, instruction }.emit());
            let reply = Reply::parse(&self.bench.take(&mut self.link)?).unwrap();
            Some((reply.status, reply.value))
        }

        fn tell(&mut self, opcode: Opcode, kind: u8, motor: u8, value: i32) {
            let answer = self.ask(opcode, kind, motor, value);
            assert!(
                answer.is_some_and(|(status, _)| status == Status::OK),
                "{opcode:?} {kind} {motor} {value}: {answer:?}"
            );
        }

        fn get(&mut self, axis: usize, id: Ap) -> i32 {
            self.bench.axis_parameter(axis, id).unwrap()
        }

        fn shaft(&mut self, axis: usize) -> i64 {
            self.bench.machine().axes[axis].plant.position()
        }
    }

    const SECOND_US: u64 = 1_000_000;

    #[test]
    fn three_axes_move_their_shafts_and_encoders() {
        let mut host = Host::new();
        for (axis, target) in [(0, 51_200), (1, -25_600), (2, 7)] {
            host.tell(Opcode::MVP, 0, axis, target);
        }
        host.bench.run_for(5 * SECOND_US);
        assert_eq!([0, 1, 2].map(|axis| host.shaft(axis)), [51_200, -25_600, 7]);
        assert_eq!(host.bench.machine().axes[1].plant.encoder_count(), -2048);
        assert_eq!(host.get(0, Ap::PositionReached), 1);
    }

    #[test]
    fn time_may_pass_in_any_portions() {
        for build in [Bench::rigid, Bench::with_defaults] {
            let positions = [1_500_000, 100_000, 7_919, 100, 99].map(|portion_us| {
                let mut host = Host::at(build(&TMCM_3351));
                host.tell(Opcode::ROR, 0, 0, 30_000);
                while host.bench.now() < 1_500_000 {
                    host.bench.run_until((host.bench.now() + portion_us).min(1_500_000));
                }
                (host.bench.machine().clone(), host.get(0, Ap::ActualPosition))
            });
            assert!(positions.iter().all(|position| *position == positions[0]));
            assert_ne!(positions[0].1, 0);
        }
    }

    #[test]
    fn motors_follow_and_come_to_rest() {
        let mut host = Host::at(Bench::with_defaults(&TMCM_3351));
        host.tell(Opcode::MVP, 0, 0, 51_200);
        host.bench.run_for(5 * SECOND_US);
        let shaft = host.shaft(0);
        assert!(shaft.abs_diff(51_200) < 30, "shaft at {shaft}");
        assert_eq!(host.bench.next_event(), None);
    }

    #[test]
    fn change_of_the_machine_wakes_a_motor_that_rests() {
        let mut host = Host::at(Bench::with_defaults(&TMCM_3351));
        host.bench.run_for(10 * SECOND_US);
        let mechanics = *host.bench.machine().axes[0].plant.mechanics().unwrap();
        host.bench.machine().axes[0].plant.set_mechanics(Mechanics { load_nm: 0.1, ..mechanics });
        assert_eq!(host.bench.next_event(), Some(10 * SECOND_US + 100));
        host.bench.run_for(SECOND_US);
        assert!((-120..-60).contains(&host.shaft(0)), "standby current holds at {}", host.shaft(0));
        assert_eq!(host.bench.next_event(), None);
    }

    #[test]
    fn time_never_goes_back() {
        let mut bench = Bench::rigid(&TMCM_3351);
        bench.run_until(500);
        bench.run_until(100);
        assert_eq!(bench.now(), 500);
    }

    #[test]
    fn scheduled_changes_happen_at_their_time_however_time_passes() {
        let shaft = [10_000_000, 100_000, 7_919].map(|portion_us| {
            let mut host = Host::new();
            let change = |line| Change::parse(line, &TMCM_3351).unwrap();
            host.bench.schedule(3 * SECOND_US, change("switch 0 right 0"));
            host.bench.schedule(2 * SECOND_US, change("switch 0 right 1"));
            host.tell(Opcode::SAP, 12, 0, 3);
            host.tell(Opcode::ROR, 0, 0, 51_200);
            while host.bench.now() < 4 * SECOND_US {
                host.bench.run_until((host.bench.now() + portion_us).min(4 * SECOND_US));
            }
            host.shaft(0)
        });
        // 1 s of ramp and 1 s at full speed, a stop at the switch, and 1 s of ramp after it.
        assert!(shaft[0].abs_diff(2 * 51_200) < 100, "{shaft:?}");
        assert_eq!(shaft, [shaft[0]; 3]);
    }

    #[test]
    fn changes_of_one_time_happen_in_the_order_of_scheduling() {
        let mut bench = Bench::rigid(&TMCM_3351);
        for line in ["power off", "in 3 1", "power on", "in 3 0"] {
            bench.schedule(SECOND_US, Change::parse(line, &TMCM_3351).unwrap());
        }
        assert_eq!(bench.next_event(), Some(SECOND_US));
        bench.run_until(SECOND_US - 1);
        assert!(bench.next_event().is_some());
        bench.run_until(SECOND_US);
        assert_eq!((bench.has_power(), bench.machine().io.levels(), bench.next_event()), (true, 0, None));
    }

    #[test]
    fn power_that_is_scheduled_comes_back() {
        let mut bench = Bench::rigid(&TMCM_3351);
        bench.power_off();
        bench.schedule(SECOND_US, Change::parse("power on", &TMCM_3351).unwrap());
        assert_eq!(bench.next_event(), Some(SECOND_US));
        bench.run_for(SECOND_US);
        assert!(bench.has_power());
    }

    #[test]
    fn idle_module_has_nothing_due() {
        let mut host = Host::new();
        host.bench.run_for(3600 * SECOND_US);
        assert_eq!(host.bench.next_event(), None);
        host.tell(Opcode::MVP, 0, 0, 100);
        assert!(host.bench.next_event().is_some_and(|at| at > host.bench.now()));
    }

    #[test]
    fn right_switch_on_the_travel_stops_the_axis() {
        let mut host = Host::new();
        host.bench.machine().axes[0].plant.travel = Travel { right: Some(Vane::above(20_000)), ..Travel::default() };
        host.tell(Opcode::SAP, 12, 0, 3);
        host.tell(Opcode::ROR, 0, 0, 20_000);
        host.bench.run_for(10 * SECOND_US);
        let shaft = host.shaft(0);
        assert!((20_000..40_000).contains(&shaft), "shaft at {shaft}");
        assert_eq!((host.get(0, Ap::RightSwitch), host.get(0, Ap::ActualSpeed)), (1, 0));
    }

    #[test]
    fn power_cut_keeps_the_eeprom_and_the_shaft_only() {
        let mut host = Host::new();
        host.tell(Opcode::SGP, 3, 2, 42);
        host.tell(Opcode::SGP, 4, 2, 43);
        host.tell(Opcode::STGP, 3, 2, 0);
        host.tell(Opcode::SIO, 0, 2, 1);
        host.tell(Opcode::MVP, 0, 0, 51_200);
        host.bench.run_for(10 * SECOND_US);

        host.bench.power_off();
        assert!(!host.bench.has_power());
        assert_eq!(host.bench.machine().io.outputs(), 0);
        assert_eq!(host.ask(Opcode::GGP, 3, 2, 0), None);
        host.bench.run_for(SECOND_US);
        assert_eq!((host.bench.next_event(), host.bench.axis_parameter(0, Ap::ActualPosition)), (None, None));

        host.bench.power_on();
        assert_eq!(host.ask(Opcode::GGP, 3, 2, 0), Some((Status::OK, 42)));
        assert_eq!(host.ask(Opcode::GGP, 4, 2, 0), Some((Status::OK, 0)));
        assert_eq!((host.get(0, Ap::ActualPosition), host.shaft(0)), (0, 51_200));
        host.tell(Opcode::MVP, 0, 0, 1000);
        host.bench.run_for(SECOND_US);
        assert_eq!(host.shaft(0), 52_200);
    }

    /// `GAP 1, 0; COMP 100; WAIT TICKS, 0, 100; CSUB 5; STOP; ADD 1; RSUB`, downloaded and started.
    fn with_program() -> Host {
        let mut host = Host::at(Bench::with_defaults(&TMCM_3351));
        host.tell(Opcode::ENTER_DOWNLOAD, 0, 0, 0);
        for (opcode, kind, motor, value) in [
            (Opcode::GAP, 1, 0, 0),
            (Opcode::COMP, 0, 0, 100),
            (Opcode::WAIT, 0, 0, 100),
            (Opcode::CSUB, 0, 0, 5),
            (Opcode::STOP, 0, 0, 0),
            (Opcode::CALC, 0, 0, 1),
            (Opcode::RSUB, 0, 0, 0),
        ] {
            assert!(host.ask(opcode, kind, motor, value).is_some_and(|(status, _)| status == Status::LOADED));
        }
        host.tell(Opcode::EXIT_DOWNLOAD, 0, 0, 0);
        host.tell(Opcode::RUN_APPLICATION, 0, 0, 0);
        host
    }

    #[test]
    fn program_is_looked_at_between_its_instructions() {
        let mut host = with_program();
        let seen = |bench: &Bench| {
            let view = bench.program().unwrap();
            (view.state(), view.registers().counter, view.registers().flags.less, view.wait().is_some())
        };
        host.bench.run_for(10);
        assert_eq!(seen(&host.bench), (ProgramState::Run, 2, true, false));
        host.bench.run_for(10);
        assert_eq!(seen(&host.bench), (ProgramState::Run, 2, true, true));
        let view = host.bench.program().unwrap();
        assert_eq!(view.wait().unwrap().deadline_us, Some(1_000_020));
        assert_eq!((view.due_us(), view.memory()[1].value, view.last_error()), (None, 100, None));
        host.bench.run_until(1_000_030);
        assert_eq!(host.bench.program().unwrap().stack(), [4]);
        host.bench.run_for(100);
        assert_eq!(seen(&host.bench).0, ProgramState::Stop);
        assert_eq!(host.bench.program().unwrap().registers().accumulator, 1);
    }

    #[test]
    fn registers_are_set_from_outside() {
        let mut host = with_program();
        host.bench.run_for(20);
        assert!(host.bench.set_program(Register::Accumulator, 41));
        assert!(host.bench.set_program(Register::Counter, 5));
        assert!(!host.bench.set_program(Register::Counter, 6144));
        host.bench.run_for(0);
        assert_eq!(host.bench.program().unwrap().registers().accumulator, 42);
    }

    #[test]
    fn copy_goes_on_alike_and_is_independent() {
        let mut host = with_program();
        host.tell(Opcode::MVP, 0, 1, 51_200);
        host.bench.run_for(700_003);
        let mut copy = host.bench.clone();
        assert_eq!(format!("{copy:?}"), format!("{:?}", host.bench));
        host.bench.run_for(2 * SECOND_US);
        assert_ne!(format!("{copy:?}"), format!("{:?}", host.bench));
        copy.run_for(2 * SECOND_US);
        assert_eq!(format!("{copy:?}"), format!("{:?}", host.bench));
    }

    #[test]
    fn restart_by_command_leaves_the_shaft_where_it_is() {
        let mut host = Host::new();
        host.tell(Opcode::MVP, 0, 0, 51_200);
        host.bench.run_for(10 * SECOND_US);
        host.tell(Opcode::SOFTWARE_RESET, 0, 0, 1234);
        host.bench.run_for(1000);
        assert_eq!((host.get(0, Ap::ActualPosition), host.shaft(0)), (0, 51_200));
    }

    #[test]
    fn module_time_starts_anew_with_the_power() {
        let mut host = Host::new();
        host.bench.run_for(100 * SECOND_US);
        host.bench.power_off();
        host.bench.power_on();
        host.bench.run_for(2 * SECOND_US);
        assert_eq!(host.ask(Opcode::GGP, 132, 0, 0), Some((Status::OK, 2000)));
        host.tell(Opcode::MVP, 0, 0, 1000);
        let due = host.bench.next_event().unwrap();
        assert!((102 * SECOND_US..103 * SECOND_US).contains(&due), "due at {due}");
    }

    #[test]
    fn reply_on_rs485_waits_for_the_telegram_pause() {
        let mut host = Host::new();
        host.tell(Opcode::SGP, 75, 0, 20);
        host.link = host.bench.attach(LinkKind::Rs485, 0);
        host.bench.run_until(SECOND_US);
        assert_eq!(host.ask(Opcode::GGP, 75, 0, 0), None);
        assert_eq!(host.bench.ready_at(&host.link), Some(SECOND_US + 20_000));
        host.bench.run_for(19_999);
        assert_eq!(host.bench.take(&mut host.link), None);
        host.bench.run_for(1);
        assert!(host.bench.take(&mut host.link).is_some());
    }
}
