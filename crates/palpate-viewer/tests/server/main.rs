//! A server on loopback, spoken to as a page does, and as a hostile one does.

mod client;
mod guard;
mod live;
mod logging;
mod logs;
