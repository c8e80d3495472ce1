//! Processes of the operating system, as far as a guardian needs them.

use std::io;
use std::process::{ChildStdin, Command};

#[cfg(unix)]
mod of_this_system {
    use super::{ChildStdin, Command, io};
    use rustix::process::{Pid, Signal, getppid, kill_process, setsid};

    /// Nothing: the process sets itself apart by [`detach`].
    pub fn set_apart(_: &mut Command) {}

    /// Leaves the session of the terminal.
    pub fn detach() {
        // It fails for the leader of a session, which needs no other.
        let _ = setsid();
    }

    /// Lets writes fail that would wait.
    pub fn set_nonblocking(pipe: &ChildStdin) -> io::Result<()> {
        Ok(rustix::io::ioctl_fionbio(pipe, true)?)
    }

    /// Kills the parent process, if it is still the one with an id.
    pub fn kill_parent(id: u32) {
        let parent = i32::try_from(id).ok().and_then(Pid::from_raw);
        if let Some(parent) = parent.filter(|parent| getppid() == Some(*parent)) {
            // It may have ended just now.
            let _ = kill_process(parent, Signal::KILL);
        }
    }
}

#[cfg(windows)]
mod of_this_system {
    use super::{ChildStdin, Command, io};
    use std::os::windows::process::CommandExt;

    /// Process without the console of its parent, whose closing it then survives.
    const DETACHED_PROCESS: u32 = 0x0000_0008;

    /// Starts the process without a console.
    pub fn set_apart(command: &mut Command) {
        command.creation_flags(DETACHED_PROCESS);
    }

    /// Nothing: the process was started apart.
    pub fn detach() {}

    /// Nothing: pipes of Windows wait. The guardian reads at once.
    pub fn set_nonblocking(_: &ChildStdin) -> io::Result<()> {
        Ok(())
    }

    /// Ends the process with an id.
    pub fn kill_parent(id: u32) {
        // It may have ended just now.
        let _ = Command::new("taskkill").args(["/F", "/PID", &id.to_string()]).output();
    }
}

pub(super) use of_this_system::{detach, kill_parent, set_apart, set_nonblocking};
