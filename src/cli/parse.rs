//! Parsing of the command line, with the options that the script declares.

use std::{collections::BTreeSet, path::Path};

use clap::{
    Arg, ArgGroup, ArgMatches, Args, CommandFactory, FromArgMatches, Subcommand, error::ErrorKind,
    parser::ValueSource,
};

use super::{
    commands::{Command, run::RunArgs},
    error::CliError,
    output::{print, print_table, terminal_format},
};
use softvt_common::text::{self, escape_control};
use softvt_script::{OptionSpec, ScriptOptionValue};

/// Parses the command line. Returns `None` if it asked for help or the version, which is then printed.
pub(super) fn parse(words: &[String]) -> Result<Option<Command>, CliError> {
    if let Some(message) = misspelt_command(words) {
        return Err(CliError::input(message));
    }
    let file = script_file(words);
    let in_file = |error: CliError| match file {
        Some(file) => error.prefixed(file),
        None => error,
    };
    let options = match file {
        Some(file) => softvt_script::declared_options(Path::new(file))?,
        None => Vec::new(),
    };
    let command = with_script_options(clap_command(), &options).map_err(in_file)?;
    if words.len() <= 1 {
        text::eprint_line(short_help(command).trim_end());
        bail!("");
    }
    let flag_without_equals = flag_without_equals(&command, words);
    let matches = match command.try_get_matches_from(words) {
        Ok(matches) => matches,
        Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            match terminal_format(false).is_coloured {
                true => print_table(&error.render().ansi().to_string())?,
                false => print(&error)?,
            }
            return Ok(None);
        }
        Err(error) => {
            let message = flag_without_equals.unwrap_or_else(|| error.to_string());
            return Err(in_file(usage_error(&message)));
        }
    };
    let parsed = match matches.subcommand_name() {
        Some(_) => Command::from_arg_matches(&matches),
        None => RunArgs::from_arg_matches(&matches).map(|args| Command::Run(Box::new(args))),
    };
    parsed.map(Some).map_err(|error| in_file(usage_error(&error.to_string())))
}

pub(super) fn clap_command() -> clap::Command {
    Command::augment_subcommands(RunArgs::command())
        .mut_subcommand("serve", |serve| serve.mut_arg("name", |name| name.requires("out")))
}

/// The help of `softvt` without arguments: the commands, and where to read on.
fn short_help(command: clap::Command) -> String {
    let template = "{name} {version}: {about}\n\n{usage-heading} {usage}\n\nCommands:\n{subcommands}\n\n\
                    softvt list suites lists the standard suites; softvt FILE.lua runs one.\n\
                    softvt --help lists all options, softvt COMMAND --help those of a command.";
    command.help_template(template).render_help().to_string()
}

/// Adds the options of a script to every command that takes the script, in a section of their own.
fn with_script_options(command: clap::Command, options: &[OptionSpec]) -> Result<clap::Command, CliError> {
    let mut flags = BTreeSet::from(["help", "version"]);
    collect_flags(&command, &mut flags);
    let args: Vec<Arg> =
        options.iter().map(|option| script_arg(option, &option.help_text(options))).collect();
    if let Some(long) = args.iter().filter_map(Arg::get_long).find(|long| flags.contains(long)) {
        bail!("the script declares the option --{long}, which is a flag of softvt; rename it");
    }
    Ok(with_script_args(command, &args))
}

/// Adds the long flags of a command and of its subcommands.
fn collect_flags<'a>(command: &'a clap::Command, flags: &mut BTreeSet<&'a str>) {
    flags.extend(command.get_arguments().filter_map(Arg::get_long));
    command.get_subcommands().for_each(|subcommand| collect_flags(subcommand, flags));
}

/// Adds `args` to a command and its subcommands, where they have [`ScriptOptions`].
fn with_script_args(command: clap::Command, args: &[Arg]) -> clap::Command {
    let command = command.mut_subcommands(|subcommand| with_script_args(subcommand, args));
    let takes_script = command.get_groups().any(|group| group.get_id() == ScriptOptions::GROUP);
    if takes_script { command.args(args) } else { command }
}

/// The options of a script that are given, as `--name=value`. A command that has this part of its arguments takes the
/// options of its script.
#[derive(Clone, Debug, Default)]
pub(crate) struct ScriptOptions {
    pub words: Vec<String>,
}

impl ScriptOptions {
    const GROUP: &str = "script-options";
    /// Start of the identifier of a script's option among the arguments; a colon cannot occur in those of the commands.
    const PREFIX: &str = "script:";
}

impl Args for ScriptOptions {
    fn augment_args(command: clap::Command) -> clap::Command {
        command.group(ArgGroup::new(Self::GROUP).multiple(true))
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for ScriptOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = matches.ids().map(clap::Id::as_str).filter_map(|id| {
            let flag = id.strip_prefix(Self::PREFIX)?;
            let is_given = matches.value_source(id) == Some(ValueSource::CommandLine);
            let value = matches.get_one::<String>(id).filter(|_| is_given)?;
            Some(format!("{flag}={value}"))
        });
        let mut words: Vec<String> = given.collect();
        // As they are declared, by name: results have them in one order, whatever that of the command line.
        words.sort_by_key(|word| word.split('=').next().map(|flag| flag.replace('-', "_")));
        Ok(Self { words })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

fn script_arg(option: &OptionSpec, help: &str) -> Arg {
    let default = match &option.default {
        ScriptOptionValue::Text(text) => format!("{text:?}"),
        other => other.to_string(),
    };
    let arg = Arg::new(format!("{}{}", ScriptOptions::PREFIX, option.flag()))
        .long(option.flag().trim_start_matches("--").to_owned())
        .help(escape_control(&format!("{help} [{}; default {default}]", option.expects())).into_owned())
        .help_heading("Options of the script");
    match option.default {
        ScriptOptionValue::Flag(_) => {
            arg.num_args(0..=1).require_equals(true).default_missing_value("on").value_name("on|off")
        }
        _ if option.unit.is_empty() => arg.num_args(1).allow_hyphen_values(true).value_name("VALUE"),
        _ => arg.num_args(1).allow_hyphen_values(true).value_name("NUMBER"),
    }
}

/// Formats a message of clap: without `error:` and without pairs of empty lines.
fn usage_error(text: &str) -> CliError {
    let mut message = String::new();
    let mut was_empty = false;
    // The tip to put a value after `--` never helps: scripts take no positional words.
    for line in text.lines().filter(|line| !line.contains("tip: to pass '")) {
        let line = line.strip_prefix("error: ").unwrap_or(line);
        if !(was_empty && line.is_empty()) {
            message += line;
            message.push('\n');
        }
        was_empty = line.is_empty();
    }
    CliError::input(message.trim_end())
}

/// A message about a first word that is neither a file nor a command: near a command, or before a script.
fn misspelt_command(words: &[String]) -> Option<String> {
    let first = words.get(1).filter(|word| !word.starts_with('-') && !word.contains(['.', '/', '\\']))?;
    let command = clap_command();
    let names: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
    if names.contains(&first.as_str()) || first == "help" || Path::new(first).exists() {
        return None;
    }
    match (text::suggest(first, names.into_iter()), words.get(2).filter(|word| word.ends_with(".lua"))) {
        (Some(close), _) => Some(format!("unknown command {first:?}; did you mean {close:?}?")),
        (None, Some(file)) => Some(format!("unknown command {first:?}; softvt {file} runs the file")),
        (None, None) => None,
    }
}

/// A message about a value that follows its flag as a word of its own, though only an equals sign gives the flag one.
fn flag_without_equals(command: &clap::Command, words: &[String]) -> Option<String> {
    let command = words.iter().find_map(|word| command.find_subcommand(word)).unwrap_or(command);
    words.iter().zip(words.iter().skip(1)).find_map(|(flag, value)| {
        let is_value = !value.starts_with('-') && !value.ends_with(".lua");
        let name = flag.strip_prefix("--").filter(|_| is_value)?;
        let arg = command
            .get_arguments()
            .find(|arg| arg.get_long() == Some(name) && arg.is_require_equals_set())?;
        let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
        Some(format!("{flag} takes its value after an equals sign: {flag}={value}. {help}"))
    })
}

/// Finds the script on the command line: the first word that ends in `.lua` and is not the value of another flag.
fn script_file(words: &[String]) -> Option<&str> {
    let pairs = words.iter().zip(words.iter().skip(1));
    let mut scripts = pairs.filter(|(previous, word)| {
        word.ends_with(".lua")
            && !word.starts_with('-')
            && !["--policy", "--profile"].contains(&previous.as_str())
    });
    scripts.next().map(|(_, word)| word.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_definition_of_the_command_line_is_consistent() {
        clap_command().debug_assert();
    }

    /// The command of `softvt WORDS`, in which `x.lua` is a script with an option.
    fn with_option(name: &str, words: &str) -> Result<Option<Command>, CliError> {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("x.lua");
        std::fs::write(&file, format!("softvt.options {{ {name} = {{ default = 1 }} }}")).expect("written");
        let words = words.replace("x.lua", file.to_str().expect("text"));
        parse(&["softvt"].into_iter().chain(words.split_whitespace()).map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn every_command_that_takes_a_script_takes_the_options_of_the_script() {
        for words in [
            "x.lua",
            "check x.lua",
            "view x.lua --out made",
            "watch x.lua",
            "record x.lua --out made",
            "serve x.lua",
            "dataset import x.lua a.hdf5 --out made",
        ] {
            let command = with_option("gap_mm", &format!("{words} --gap-mm=3")).expect(words).expect(words);
            let parsed = format!("{command:?}");
            assert!(parsed.contains(r#"ScriptOptions { words: ["--gap-mm=3"] }"#), "{words}: {parsed}");
        }
    }

    #[test]
    fn options_of_a_script_have_the_order_of_their_names() {
        let command = with_option("a = { default = 1 }, b", "x.lua --b 2 --a=3").expect("valid");
        let parsed = format!("{:?}", command.expect("a command"));
        assert!(parsed.contains(r#"ScriptOptions { words: ["--a=3", "--b=2"] }"#), "{parsed}");
    }

    #[test]
    fn an_option_of_a_script_cannot_have_the_name_of_a_flag_of_any_command() {
        for name in ["seed", "demos", "keep", "port", "images", "require"] {
            let message = with_option(name, "x.lua").expect_err(name).message;
            let expected =
                format!("the script declares the option --{name}, which is a flag of softvt; rename it");
            assert!(message.ends_with(&expected), "{message}");
        }
    }

    #[test]
    fn a_value_that_needs_an_equals_sign_has_a_message_of_its_own() {
        let message = |words: &str| {
            let words: Vec<String> = words.split(' ').map(str::to_owned).collect();
            flag_without_equals(&clap_command(), &words)
        };
        let told = message("softvt x.lua --video all").unwrap_or_default();
        let expected = "--video takes its value after an equals sign: --video=all. Render videos of unsafe episodes; =all for";
        assert!(told.starts_with(expected), "{told}");
        for words in [
            "softvt replay run --mcap x.mcap",
            "softvt --video x.lua",
            "softvt x.lua --video --json",
            "softvt x.lua --threads 2",
        ] {
            assert_eq!(message(words), None, "{words}");
        }
    }

    #[test]
    fn misspelt_commands_are_named() {
        let message = |words: &[&str]| {
            misspelt_command(&["softvt"].iter().chain(words).map(ToString::to_string).collect::<Vec<_>>())
        };
        let expected = "unknown command \"recrod\"; did you mean \"record\"?";
        assert_eq!(message(&["recrod", "suites/x.lua"]).as_deref(), Some(expected));
        let run = "unknown command \"run\"; softvt x.lua runs the file";
        assert_eq!(message(&["run", "x.lua"]).as_deref(), Some(run));
        for words in [&["record", "x.lua"][..], &["help"], &["suites/x.lua"], &["x.lua"], &["--version"], &[]]
        {
            assert_eq!(message(words), None, "{words:?}");
        }
    }
}
