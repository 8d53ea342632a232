//! Settings: parameters that a run may change by name, each declared once.
//!
//! [`settings!`](crate::settings!) makes a struct of them, with defaults, checks of their ranges, and a list for
//! documentation.
//!
//! ```
//! use softvt_common::{range::Range, settings::{Setting, SettingField}};
//!
//! softvt_common::settings! {
//!     /// Drive of a finger.
//!     pub struct DriveSpec {
//!         /// Stiffness.
//!         kp: f64 = 2000.0, "N/m", Range::POSITIVE;
//!         /// True if it moves at all.
//!         enabled: bool = true;
//!     }
//! }
//! let drive = DriveSpec { kp: -1.0, ..DriveSpec::default() };
//! let error = drive.check("drive").unwrap_err();
//! assert_eq!(error.to_string(), "drive.kp: expected a number above 0 (N/m), got -1");
//! let names: Vec<String> = Setting::list::<DriveSpec>("drive").into_iter().map(|setting| setting.path).collect();
//! assert_eq!(names, ["drive.kp", "drive.enabled"]);
//! ```

use serde::Serialize;
use serde_json::Value;

use super::{
    range::{Range, RangeError},
    text::exact_number,
};

/// One setting, for documentation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setting {
    /// Dotted path, as `--set` takes it.
    pub path: String,
    /// Value unless a suite or a run changes it; null where it follows from the scene.
    pub default: Value,
    /// Allowed values, in words.
    pub values: String,
    /// Meaning.
    pub about: String,
}

impl Setting {
    /// The default in words.
    pub fn default_text(&self) -> String {
        match &self.default {
            Value::Null => "that of the scene".to_owned(),
            Value::Number(number) => number.as_f64().map_or_else(|| number.to_string(), exact_number),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        }
    }

    /// All settings of a group at a path.
    pub fn list<T: SettingField + Default>(path: &str) -> Vec<Self> {
        let mut list = Vec::new();
        T::default()
            .describe(&SettingDeclaration { path, unit: "", range: Range::ANY, about: "" }, &mut list);
        list
    }
}

/// Unit, range and documentation of a setting.
#[derive(Clone, Copy, Debug)]
pub struct SettingDeclaration<'a> {
    /// Dotted path.
    pub path: &'a str,
    /// Unit; empty for none.
    pub unit: &'a str,
    /// Range of a number.
    pub range: Range,
    /// Meaning.
    pub about: &'a str,
}

impl SettingDeclaration<'_> {
    /// The setting with this default and these values.
    pub fn setting(&self, default: impl Serialize, values: String) -> Setting {
        let default = serde_json::to_value(default).unwrap_or_default();
        Setting {
            path: self.path.to_owned(),
            default,
            values,
            about: self.about.split_whitespace().collect::<Vec<_>>().join(" "),
        }
    }

    /// A setting that is `noun`, "a number" or another, within the declared range.
    fn number(&self, default: impl Serialize, noun: &str) -> Setting {
        self.setting(default, self.range.expected(noun, self.unit))
    }
}

/// A setting or a group of settings.
pub trait SettingField {
    /// Appends the settings that this default value stands for.
    fn describe(&self, declaration: &SettingDeclaration<'_>, list: &mut Vec<Setting>);

    /// Checks the range of the value at a path, or of all values of a group.
    ///
    /// # Errors
    /// The first value out of its range.
    fn check_declared(&self, declaration: &SettingDeclaration<'_>) -> Result<(), RangeError>;

    /// As [`Self::check_declared`], for a group at `path`.
    ///
    /// # Errors
    /// The first value out of its range.
    fn check(&self, path: &str) -> Result<(), RangeError> {
        self.check_declared(&SettingDeclaration { path, unit: "", range: Range::ANY, about: "" })
    }
}

impl SettingField for f64 {
    fn describe(&self, declaration: &SettingDeclaration<'_>, list: &mut Vec<Setting>) {
        list.push(declaration.number(self, "a number"));
    }

    fn check_declared(&self, declaration: &SettingDeclaration<'_>) -> Result<(), RangeError> {
        declaration.range.check(declaration.path, *self, declaration.unit)
    }
}

impl SettingField for u32 {
    fn describe(&self, declaration: &SettingDeclaration<'_>, list: &mut Vec<Setting>) {
        list.push(declaration.number(self, "a whole number"));
    }

    fn check_declared(&self, declaration: &SettingDeclaration<'_>) -> Result<(), RangeError> {
        f64::from(*self).check_declared(declaration)
    }
}

impl SettingField for Option<usize> {
    fn describe(&self, declaration: &SettingDeclaration<'_>, list: &mut Vec<Setting>) {
        list.push(declaration.number(self, "a whole number"));
    }

    fn check_declared(&self, declaration: &SettingDeclaration<'_>) -> Result<(), RangeError> {
        self.map_or(Ok(()), |number| (number as f64).check_declared(declaration))
    }
}

impl SettingField for bool {
    fn describe(&self, declaration: &SettingDeclaration<'_>, list: &mut Vec<Setting>) {
        list.push(declaration.setting(self, "true or false".to_owned()));
    }

    fn check_declared(&self, _: &SettingDeclaration<'_>) -> Result<(), RangeError> {
        Ok(())
    }
}

/// Declares a group of settings, see the [module](mod@crate::settings).
///
/// A field is `name: type = default, unit, range;`. Switches have neither unit nor range, and groups no default either.
#[macro_export]
macro_rules! settings {
    (
        $(#[$meta:meta])*
        pub struct $name:ident {
            $(
                $(#[doc = $doc:literal])*
                $field:ident: $type:ty $(= $default:expr $(, $unit:literal, $range:expr)?)?;
            )*
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, ::serde::Serialize, ::serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $(
                $(#[doc = $doc])*
                $(
                    #[doc = concat!(
                        "\n\nDefault `", stringify!($default), "`" $(, ", unit `", $unit, "`, range `", stringify!($range), "`")?, "."
                    )]
                )?
                pub $field: $type,
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $crate::settings!(@default $type $(, $default)?),)* }
            }
        }

        impl $crate::settings::SettingField for $name {
            fn describe(
                &self,
                declaration: &$crate::settings::SettingDeclaration<'_>,
                list: &mut Vec<$crate::settings::Setting>,
            ) {
                $(
                    let path = format!("{}.{}", declaration.path, stringify!($field));
                    let about = concat!($($doc, "\n",)* "");
                    let declared = $crate::settings!(@declared path, about $($(, $unit, $range)?)?);
                    $crate::settings::SettingField::describe(&self.$field, &declared, list);
                )*
            }

            fn check_declared(
                &self,
                declaration: &$crate::settings::SettingDeclaration<'_>,
            ) -> Result<(), $crate::range::RangeError> {
                $(
                    let path = format!("{}.{}", declaration.path, stringify!($field));
                    let declared = $crate::settings!(@declared path, "" $($(, $unit, $range)?)?);
                    $crate::settings::SettingField::check_declared(&self.$field, &declared)?;
                )*
                Ok(())
            }
        }
    };
    (@default $type:ty) => { <$type>::default() };
    (@default $type:ty, $default:expr) => { $default };
    (@declared $path:ident, $about:expr) => {
        $crate::settings::SettingDeclaration { path: &$path, unit: "", range: $crate::range::Range::ANY, about: $about }
    };
    (@declared $path:ident, $about:expr, $unit:literal, $range:expr) => {
        $crate::settings::SettingDeclaration { path: &$path, unit: $unit, range: $range, about: $about }
    };
}
