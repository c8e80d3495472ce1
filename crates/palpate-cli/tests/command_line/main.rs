//! The command `palpate` from outside: what it prints and writes, what it refuses and how it says so.

mod bad_contact_scenes;
mod bad_input;
mod contacts;
mod couplings;
mod cut_logs;
mod devices;
mod documentation;
mod experiments;
mod exports;
mod glb;
mod guardian;
mod loads;
mod meshes;
mod old_logs;
mod realtime;
mod recording_options;
mod reproduction;
mod results;
mod sound;
mod stores;
mod streams;
mod viewer;
mod viewer_access;
mod workplace;
