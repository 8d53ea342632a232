# Sourced by .ci/run and by the tests that need other software.
#
# With CI=true such a test installs what it needs, and fails if that is not possible. Otherwise it installs Python packages into an
# environment of its own, and is skipped if anything else is missing: it says SKIPPED with the reason, writes the reason to the
# file that SKIP_REASON names, and exits with status 77.

is_ci() { [[ ${CI:-} == true ]]; }

# skip REASON: ends the test.
skip() {
    if is_ci; then
        echo "FAILED: $1; with CI=true no test is skipped" >&2
        exit 1
    fi
    echo "SKIPPED: $1" >&2
    [[ -z ${SKIP_REASON:-} ]] || echo "$1" > "$SKIP_REASON"
    exit 77
}

# install_debian PACKAGE...: installs packages of Debian or Ubuntu, with CI=true only.
install_debian() {
    is_ci && command -v apt-get >/dev/null || return 1
    local root=()
    [[ $EUID == 0 ]] || root=(sudo -n)
    "${root[@]}" apt-get update -qq >/dev/null \
        && "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

# python_environment FOLDER REASON ARGUMENT...: makes an environment with the packages that pip gets as arguments, or skips; nothing
# is left to do if it has been made with the same arguments. With VENV_FLAGS=--system-site-packages it also has those of python3.
# VENV_PYTHON names another interpreter than python3. Most modules of large packages are never imported, hence not compiled.
python_environment() {
    local folder=$1 reason=$2 why made
    shift 2
    made=$folder/made-$(cksum <<< "$*" | tr ' ' '-')
    [[ ! -e $made ]] || return 0
    if ! why=$({ "${VENV_PYTHON:-python3}" -m venv ${VENV_FLAGS:-} "$folder" \
        && "$folder/bin/pip" install --quiet --disable-pip-version-check --no-compile "$@"; } 2>&1); then
        tail -n 3 <<< "$why" >&2
        skip "$reason"
    fi
    touch "$made"
}

# environments_only: ends a test whose environments are made in advance. .ci/run names their folder, ENVIRONMENTS, and runs the
# tests so while the code compiles; without it they are in the folder of the argument.
environments_only() {
    [[ ${ENVIRONMENTS_ONLY:-} != true ]] || exit 0
}

# short_suite SUITE STEPS FILE: writes a copy of a suite whose tasks have that many control steps, for what does not depend on the goal.
short_suite() {
    printf 'local suite = require "suites.%s"\nfor _, task in ipairs(suite.tasks) do task.budget_steps = %d end\nreturn suite\n' "$1" "$2" > "$3"
}

skipped=()

# optional_stage NAME SCRIPT: runs a test of the above kind, and adds it to `skipped` if it was skipped. In a subshell, SKIPPED names a
# file that gets it too.
optional_stage() {
    local status=0 reason
    reason=$(mktemp)
    SKIP_REASON=$reason "$2" || status=$?
    if [[ $status == 77 ]]; then
        skipped+=("$1: $(<"$reason")")
        [[ -z ${SKIPPED:-} ]] || echo "${skipped[-1]}" >> "$SKIPPED"
        status=0
    fi
    rm -f "$reason"
    return $status
}

# closing_lines: says how many stages were skipped, and which.
closing_lines() {
    if [[ ${#skipped[@]} == 0 ]]; then
        echo "all checks passed, none skipped"
    else
        echo "all other checks passed, ${#skipped[@]} skipped:"
        printf '  %s\n' "${skipped[@]}"
    fi
}
