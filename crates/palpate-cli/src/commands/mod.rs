//! Commands: one command, one file or folder.

pub mod bench;
pub mod completions;
pub mod demo;
pub mod device;
pub mod devices;
pub mod export;
pub mod guard;
pub mod inspect;
pub mod materials;
pub mod mesh;
pub mod record;
pub mod recover;
pub mod render;
pub mod replay;
pub mod reproduce;
pub mod run;
pub mod scenes;
pub mod serve;
pub mod verify;
