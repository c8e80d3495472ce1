//! Software that is not there, or not what it should be.

use palpate_haptics::device::Driver;

#[test]
fn without_a_library_it_says_what_was_tried_and_what_to_do() {
    for (driver, variable, software) in [
        (Driver::OpenHaptics, "PALPATE_LIBHD", "3D Systems' OpenHaptics"),
        (Driver::Dhd, "PALPATE_LIBDHD", "Force Dimension's SDK"),
    ] {
        let error = driver.find(Some("/nowhere/lib.so")).expect_err("there is none").to_string();
        let name = driver.name();
        for part in [
            &format!("{name}: no library could be loaded as /nowhere/lib.so (/nowhere/lib.so: "),
            &format!("install {software}"),
            &format!("name the library's file in the environment variable {variable}"),
        ] {
            assert!(error.contains(part), "{part}: {error}");
        }
        assert_eq!(driver.variable(), variable);
        assert_eq!(Driver::named(name), Some(driver));
        assert!(driver.open("0", Some("/nowhere/lib.so")).is_err());
    }
}

#[test]
fn a_library_without_the_functions_is_told_from_the_right_one() {
    let standin = super::standin::Standin::new("libdhd");
    let error = Driver::OpenHaptics.find(Some(standin.place())).expect_err("another library").to_string();
    let file = standin.place();
    assert_eq!(
        error,
        format!(
            "openhaptics: {file} has no function hdInitDevice: it is not the library of 3D Systems' OpenHaptics and the driver \
             of the device, or an old one"
        )
    );
}

#[test]
fn a_file_that_is_no_library_is_no_library() {
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), "no library").expect("a writable file");
    let error = Driver::Dhd.find(file.path().to_str()).expect_err("no library").to_string();
    assert!(error.starts_with("dhd: no library could be loaded as "), "{error}");
}
