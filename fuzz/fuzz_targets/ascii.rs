//! Keys into the ASCII interface of a TMCM-351, and lines into what reads its commands and its replies.

#![no_main]

use gradus_sim::{Bench, LinkKind};
use gradus_tmcl::ascii::{Line, Reply};
use gradus_tmcl::catalogue::{MODULES, TMCM_351};
use gradus_tmcl::{Instruction, Opcode, Request};

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    for line in data.split(|byte| *byte == b'\r') {
        for module in MODULES {
            let _ = Line::parse(line, module);
        }
        let _ = Reply::parse(line);
    }
    let mut bench = Bench::rigid(&TMCM_351);
    let mut link = bench.attach(LinkKind::Usb, 0);
    let ascii = Request { address: 1, instruction: Instruction::new(Opcode::ASCII_MODE, 0, 0, 0) };
    bench.send(&mut link, &ascii.emit());
    let mut answered = 0;
    for keys in data.chunks(20) {
        bench.send(&mut link, keys);
        bench.run_for(2_000);
        while bench.take(&mut link).is_some() {}
        while bench.take_byte(&mut link).is_some() {
            answered += 1;
        }
    }
    assert!(answered < 1_000 + 100 * data.len(), "{answered} characters answer {}", data.len());
});
