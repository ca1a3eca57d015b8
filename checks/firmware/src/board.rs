//! Start, clock and output of the board mps2-an386 of qemu, a Cortex-M4F.

use core::arch::{asm, global_asm};
use core::fmt::{self, Write};
use core::panic::PanicInfo;
use core::ptr::{read_volatile, write_volatile};

use crate::work;

// The FPU must be on before any function that may use it.
global_asm!(
    ".section .text.reset, \"ax\"",
    ".thumb_func",
    ".global reset",
    "reset:",
    "ldr r0, =0xE000ED88",
    "ldr r1, [r0]",
    "orr r1, r1, #0xF00000",
    "str r1, [r0]",
    "dsb",
    "isb",
    "bl {main}",
    "b .",
    main = sym main
);

/// Instructions of one tick: the clock of the board has 25 MHz, and with `-icount shift=0` an instruction takes 1 ns.
const PER_TICK: u32 = 40;

const SYSTICK_CONTROL: *mut u32 = 0xE000_E010 as *mut u32;
const SYSTICK_RELOAD: *mut u32 = 0xE000_E014 as *mut u32;
const SYSTICK_CURRENT: *mut u32 = 0xE000_E018 as *mut u32;

fn start_clock() {
    // SAFETY: the three registers of the SysTick timer, which every Cortex-M4 has and nothing else here uses.
    unsafe {
        write_volatile(SYSTICK_RELOAD, 0x00FF_FFFF);
        write_volatile(SYSTICK_CURRENT, 0);
        write_volatile(SYSTICK_CONTROL, 0b101);
    }
}

/// Ticks since the start. It wraps after 16 million: a thousand times what one case takes.
fn ticks() -> u32 {
    // SAFETY: reading the current value of the SysTick timer changes nothing but a flag that nothing here looks at.
    0x00FF_FFFF - unsafe { read_volatile(SYSTICK_CURRENT) }
}

/// A call of the host that runs qemu.
fn semihosting(operation: u32, argument: *const u8) {
    // SAFETY: qemu handles the breakpoint; the two operations used here read at most a string that ends in zero.
    unsafe { asm!("bkpt #0xAB", inout("r0") operation => _, in("r1") argument) };
}

struct Console;

impl Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            semihosting(0x03, &byte);
        }
        Ok(())
    }
}

/// Ends qemu: with success or not.
fn exit(success: bool) -> ! {
    let reason = if success { 0x20026 } else { 0x20023 };
    semihosting(0x18, reason as *const u8);
    loop {}
}

extern "C" fn main() -> ! {
    start_clock();
    let mut nothing = 0;
    let done = work::all(ticks, |case| {
        let instructions = case.per_sample(PER_TICK);
        if case.is_nothing() {
            nothing = instructions;
        }
        _ = writeln!(Console, "{case} {:6}", instructions - nothing);
    });
    work::sizes(|what, number, bytes| _ = writeln!(Console, "bytes: {what} {number} {bytes}"));
    exit(done.is_ok());
}

#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    exit(false)
}
