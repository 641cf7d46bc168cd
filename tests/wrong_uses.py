"""Wrong uses of the command line: every command and option, with values of each kind.

The tree of commands gives the options; the tables below say what each of them is, so
that a new option without an entry is noticed.
"""

from ikns.cli.app import command_parser

__all__ = ["ALL", "options", "undescribed"]

#: Uses that are right but for what is appended. Braces name files of the test.
RIGHT = {
    "demo": "--out new",
    "check": "{free} --subject {person}",
    "scale": "--stature 1.7 --mass 70 --sex male --out new.urdf",
    "calibrate": "--static {static} --exploration {points} --out new",
    "ik": "{free} --subject {person} --out new.csv",
    "control": "{free} --subject {person} --out new.csv",
    "convert": "{free} new.trc",
    "markers list": "",
    "markers show": "oxford24",
    "markers sites": "",
    "markers check": "oxford24 {static}",
    "markers new": "{static} --guess --out new.toml",
    "compare": "{points} --subject {person}",
    "robot": "{urdf} {angles} --frame tip",
    "ucm": "{points} --subject {person}",
    "view": "{person} {free} --out new.html",
    "run": "--subject {person} --source replay:{free} --dry-run --session new",
    "replay": "{session}",
    "stream": "{free} --wait 0.1",
    "servo": "--duration 0.1",
    "track": "new --no-browser --conditions virtual",
    "pick": "new --no-browser --conditions ring",
    "report": "{study} --out new",
    "study init": "new",
    "study run": "{study}",
    "study plan": "--margin 5",
    "docs": "--no-open",
}

NOT_A_NUMBER = ["x", ""]
NOT_WHOLE = [*NOT_A_NUMBER, "1e999", "0.5", "1" + "0" * 30]
NOT_FINITE = [*NOT_A_NUMBER, "nan", "-inf", "1e999", "1e300"]
SEED = [*NOT_WHOLE, "-1"]
COUNT = [*NOT_WHOLE, "-1", "0"]
FROM_ZERO = [*NOT_FINITE, "-1"]
POSITIVE = [*NOT_FINITE, "-1", "0"]
CHOICE = ["", "nan", "no-such-choice"]
READ_FILE = ["", "{nowhere}", "{folder}", "{binary}", "{empty}", "{latin}", "{deep}"]
READ_FOLDER = ["", "{nowhere}", "{binary}", "{folder}", "{latin}", "{deep}"]
WRITE_FILE = ["", "{folder}", "{nowhere}/x", "{binary}/x", "{latin}", "{deep}"]
PICTURE = [*WRITE_FILE, "x.exe", "x", "{binary}"]
WRITE_FOLDER = ["", "{binary}", "{nowhere}/x", "{binary}/x", "{latin}", "{deep}"]
SOURCE = [
    "",
    "x",
    "natnet:",
    "ros2:",
    "ros2:/markers?rate=0",
    "replay:",
    "replay:{nowhere}",
    "replay:{binary}",
    "replay:{folder}",
]
PUBLISH = [
    "",
    "x",
    "lsl:",
    "lsl: ",
    "udp:c",
    "lsl:c?scope=moon",
    "lsl:c?x=1",
    "ros2:",
    "ros2:9",
    "ros2:a?router=x",
]
FINGER = [
    "",
    "x",
    "sim:?safe=x",
    "dynamixel:",
    "dynamixel:{nowhere}?id=-1",
    "ros2:",
    "ros2:/f",
    "ros2:/f?type=position&open=0&closed=1",
    "lerobot:x",
]
TEXT = ["", "a\udcff"]
FLAG: list[str] = []

#: Wrong values of each option, by name, or by command and name where they differ.
WRONG = {
    "align": FROM_ZERO,
    "alpha": [*POSITIVE, "1"],
    "angles": READ_FILE,
    "answer_delay": FROM_ZERO,
    "baud": COUNT,
    "calibrate recordings": ["{binary}", "{latin}"],
    "chain": CHOICE,
    "conditions": [*TEXT, "x", "keyboard,keyboard", "virtual,keyboard"],
    "control out": WRITE_FILE,
    "coordinates": CHOICE,
    "countdown": FROM_ZERO,
    "check marker_set": ["lost", "{binary}", "{folder}"],
    "convert source": READ_FILE,
    "convert stream": ["", "no-such-stream"],
    "cutoff": POSITIVE,
    "difference": NOT_FINITE,
    "duration": FROM_ZERO,
    "experiment": CHOICE,
    "exploration": READ_FILE,
    "export": ["", "{folder}", "{nowhere}/x.csv", "x.exe", "{latin}"],
    "fault": ["x", "silence@nan", "silence@-1", "delay=inf@0", "crc=1@0"],
    "figure": PICTURE,
    "finger": FINGER,
    "folder": WRITE_FOLDER,
    "frame": [*TEXT, "nowhere"],
    "free_seconds": POSITIVE,
    "hold_speed": FROM_ZERO,
    "max_uncertainty": FROM_ZERO,
    "host": [*TEXT, "no.such.host.invalid", "999.1.1.1"],
    "id": [*NOT_WHOLE, "-1", "255"],
    "from_": ["", "nan", "1e999", "1e300", "no-such-event"],
    "ik out": WRITE_FILE,
    "ik static": READ_FILE,
    "intervals": [*NOT_WHOLE, "-1"],
    "jobs": [*NOT_WHOLE, "-2", "0"],
    "labels": READ_FILE,
    "level_spread": FROM_ZERO,
    "levels": COUNT,
    "limit": POSITIVE,
    "link": ["", "{binary}", "{nowhere}/x", "{folder}", "{latin}"],
    "margin": POSITIVE,
    "marker_set": [*TEXT, "lost", "{binary}", "{folder}"],
    "mass": POSITIVE,
    "max_hand_speed": POSITIVE,
    "min_rest": FROM_ZERO,
    "min_static": FROM_ZERO,
    "min_still": FROM_ZERO,
    "mode": CHOICE,
    "model": [*TEXT, "xyz"],
    "most": [*COUNT, "1"],
    "movement": READ_FILE,
    "most_different": FROM_ZERO,
    "n_dof": COUNT,
    "name": TEXT,
    "number": SEED,
    "objects": [*TEXT, "x", "A,A"],
    "obstacle": NOT_FINITE,
    "onset_speed": POSITIVE,
    "out": WRITE_FOLDER,
    "outside": ["", "no-such-choice"],
    "participant": [*TEXT, "a/b", "..", "a b"],
    "participants": COUNT,
    "pictures": WRITE_FOLDER,
    "pilot": READ_FOLDER,
    "png": PICTURE,
    "animation": PICTURE,
    "publish": PUBLISH,
    "rrd": [*WRITE_FILE, "x.exe", "x"],
    "point": [*COUNT, "99"],
    "point_seconds": POSITIVE,
    "points": COUNT,
    "port": [*NOT_WHOLE, "-1", "65536"],
    "power": [*POSITIVE, "1"],
    "profiles": [*TEXT, "T9", "T1,T1"],
    "radius": POSITIVE,
    "rate": POSITIVE,
    "reaches": READ_FILE,
    "recording": READ_FILE,
    "recordings": READ_FILE,
    "method": CHOICE,
    "natural": READ_FILE,
    "natural_seconds": FROM_ZERO,
    "markers check marker_set": ["", "nan", "{nowhere}", "{folder}", "{binary}"],
    "markers new name": TEXT,
    "markers new out": [*WRITE_FILE, "x.exe"],
    "markers show marker_set": ["", "nan", "{nowhere}", "{folder}", "{binary}"],
    "rename": ["", "x", "=", "A=", "=B", "A=B=C"],
    "repeats": COUNT,
    "replay session": READ_FOLDER,
    "rest": FROM_ZERO,
    "robot start": ["", "no-such-link", "tip"],
    "robot up": CHOICE,
    "run": [*NOT_WHOLE, "-1", "0", "99"],
    "safe_state": CHOICE,
    "scale out": WRITE_FILE,
    "scheduler": [*TEXT, "x", "tcp://"],
    "seconds": POSITIVE,
    "seed": SEED,
    "session": WRITE_FOLDER,
    "sex": CHOICE,
    "side": CHOICE,
    "simulations": COUNT,
    "source": SOURCE,
    "speed": POSITIVE,
    "spread": POSITIVE,
    "static": READ_FILE,
    "static_seconds": POSITIVE,
    "stature": POSITIVE,
    "stick": CHOICE,
    "stream fault": ["x", "drop=nan", "drop=2", "late=0.1:inf", "drop=-1", "drop"],
    "study run folder": READ_FOLDER,
    "sites": READ_FILE,
    "study": READ_FOLDER,
    "subject": READ_FOLDER,
    "surrogates": COUNT,
    "subject_prefix": ["", ":", "nobody"],
    "target": [*WRITE_FILE, "x.exe", "x"],
    "task": CHOICE,
    "to": ["", "nan", "-inf", "-1", "no-such-event"],
    "training": [*NOT_WHOLE, "-1"],
    "trial_spread": FROM_ZERO,
    "urdf": READ_FILE,
    "view out": WRITE_FILE,
    "view subject": READ_FOLDER,
    "visit": WRITE_FOLDER,
    "wait": FROM_ZERO,
    "worker_timeout": POSITIVE,
}
FLAGS = {
    *("as_json", "auto", "browser", "clavicle", "dry_run", "everywhere", "force"),
    *("guess", "live", "loop", "open_page", "quick", "realtime", "resume", "simulated"),
    *("rerun", "rewear", "short", "smooth", "view"),
}
#: Options that count only together with others.
WITH = {
    "check marker_set": "--static {static}",
    "check static": "",
    "ik marker_set": "--static {static}",
    "ik min_static": "--static {static}",
    "calibrate source": "--live",
    "calibrate static_seconds": "--live --source replay:{free}",
    "calibrate free_seconds": "--live --source replay:{free}",
    "calibrate natural_seconds": "--live --source replay:{free}",
    "calibrate point_seconds": "--live --source replay:{free}",
    "calibrate countdown": "--live --source replay:{free}",
    "calibrate recordings": "--live --source replay:{free}",
    "calibrate subject": "--rewear --natural {free}",
    "calibrate stature": "--mass 70 --sex male",
    "calibrate mass": "--stature 1.7 --sex male",
    "calibrate sex": "--stature 1.7 --mass 70",
    "study plan level_spread": "--spread 1",
    "study plan trial_spread": "--spread 1",
    "track source": "--subject {person}",
    "track subject": "--source replay:{free}",
    "pick source": "--subject {person}",
    "pick subject": "--source replay:{free}",
    "track participant": "",
}
#: Conditions in which an option of a visit counts.
ARM = ("source", "subject", "finger", "session", "hold_speed")
#: Values that are right for one command.
RIGHT_THERE = {
    # Their parents are made.
    ("run", "session", "{nowhere}/x"),
    ("track", "visit", "{nowhere}/x"),
    ("pick", "visit", "{nowhere}/x"),
}

#: Whole command lines: options that exclude each other, need each other or are missing.
TOGETHER = [
    "",
    "--no-such-option",
    "dance",
    "study",
    "study dance",
    "demo extra",
    "demo --out",
    "demo --seed 1 --sede 2",
    "scale",
    "scale --stature 1.7",
    "scale --stature 1.7 --mass 70 --sex male",
    "ik",
    "ik {free}",
    "ik {free} --static {binary} --out new.csv",
    "ik {free} --static {static} --marker-set lost --out new.csv",
    "ik {free} --subject {person} --static {static} --out new.csv",
    "ik {free} --subject {person} --out new.csv --out new.csv",
    "ik {free} --subject {person} --out new.mat",
    "convert",
    "convert {free}",
    "convert {free} {points}",
    "convert {free} new.mot",
    "convert {free} new.trc --from 5 --to 1",
    "calibrate --out new --live --source replay:{free} --subject-prefix Ann",
    "markers list extra",
    "markers sites extra",
    "ik {free} --static {binary} --out new.csv",
    "ik {free} --static {static} --marker-set lost --out new.csv",
    "ik {free} --subject {person} --out new.csv --out new.csv",
    "convert",
    "convert {free}",
    "convert {free} {points}",
    "convert {free} new.trc --from 5 --to 1",
    "convert {free} new.trc --from 1e6",
    "calibrate --out new --live --source replay:{free} --subject-prefix Ann",
    "calibrate --out new --live --source replay:{free} --from 1",
    "convert {angles} new.mot --rename A=B",
    "convert {free} new.trc --rename RWRA=RWRB",
    "run --subject {person} --source replay:{free} --rename RWRA=RELBOW",
    "run --subject {person} --source replay:{free} --rename RWRA=RWRB",
    "ucm {points} --subject {person} --from 5 --to 1",
    "markers new {static} --guess --out new.toml --from 5 --to 1",
    "markers check oxford24 {static} --from 1e6",
    "markers new {static} --sites {angles} --side left --out new.toml",
    "compare {points} --subject {person} --from 1e6",
    "check {free} --subject {person} --to -1",
    "calibrate --static {static} --exploration {points} --out new --from 1e6",
    "calibrate --out new --static {static} --exploration {points} --short",
    "calibrate --out new --static {static} --exploration {points} --chain right_arm "
    "--side right",
    "calibrate --out new --static {static} --exploration {points} --chain left_arm "
    "--clavicle",
    "calibrate --out new --static {static} --exploration {points} --chain {binary}",
    "compare {points} --subject {person} --chain {nowhere}.toml",
    "calibrate --out new --static {static} --exploration {points} --subject {person}",
    "calibrate --out new --rewear",
    "calibrate --out new --rewear --subject {person} --static {static}",
    "calibrate --out {person} --rewear --subject {person} --static {static} "
    "--natural {free} --force",
    "calibrate --out new --rewear --subject {person} --static {static} "
    "--natural {static}",
    "calibrate --out new --rewear --subject {person} --static {static} "
    "--natural {free} --points 2",
    "check",
    "check {free} --subject {person} --marker-set oxford24",
    "check {free} --subject {person} --static {static}",
    "ik {free} --subject {person} --marker-set oxford24 --out new.csv",
    "ik {free} --subject {person} --static {static} --out new.csv",
    "ik {free} {points} --subject {person} --out new.csv",
    "calibrate --out new",
    "calibrate --out new --static {static}",
    "calibrate --out new --exploration {points}",
    "calibrate --out new --static {static} --exploration {points} --source lsl:x",
    "calibrate --out new --static {static} --exploration {points} --resume",
    "calibrate --out new --live",
    "calibrate --out new --live --source replay:{free} --static {static}",
    "calibrate --out new --live --source replay:{free} --exploration {points}",
    "calibrate --static {static} --exploration {points} --out new --side both "
    "--clavicle",
    "calibrate --static {static} --exploration {points} --out new --mass 70",
    "robot {urdf}",
    "robot {urdf} {angles}",
    "robot {angles} {urdf} --frame tip",
    "robot {nested} {angles} --frame tip",
    "robot {still_axis} {angles} --frame tip",
    "robot {nan_axis} {angles} --frame tip",
    "robot {loop} {angles} --frame tip",
    "robot {no_parent} {angles} --frame tip",
    "robot {bad_origin} {angles} --frame tip",
    "robot {bad_limit} {angles} --frame tip",
    "robot {two_roots} {angles} --frame tip",
    "robot {twins} {angles} --frame tip",
    "robot {entities} {angles} --frame tip",
    "robot {not_robot} {angles} --frame tip",
    "robot {strange_type} {angles} --frame tip",
    "robot {no_type} {angles} --frame tip",
    "ucm --subject {person}",
    "ucm {points} {points} --subject {person}",
    "view {person} --out same.png --png same.png",
    "view {person} --png same.png --animation same.png",
    "view {person} --animation moving.mp4",
    "view {person} {free} {points}",
    "run --subject {person}",
    "run --subject {person} --source replay:{free} --resume",
    "run --subject {person} --source replay:{free} --safe-state float",
    "replay",
    "stream",
    "stream {free} --speed 0 --loop",
    "servo --baud 57601",
    "track",
    "track new --study {study}",
    "track --study {study}",
    "track --study {study} --participant 01 --repeats 2",
    "track new --conditions ikns --no-browser",
    "track new --conditions ikns --no-browser --subject {person}",
    "track new --conditions ikns --no-browser --source replay:{free}",
    "track new --conditions virtual,keyboard --no-browser",
    "track new --participant abc --no-browser",
    "pick",
    "pick new --study {study}",
    "pick --study {study}",
    "pick new --conditions ikns --no-browser",
    "report",
    "report {study} --out {study}",
    "study init",
    "study init {study}",
    "study run",
    "study run {study} --scheduler tcp://127.0.0.1:1 --participants 0",
    "study plan",
    "study plan --margin 5 --spread 1 --pilot {study}",
    "study plan {study} --spread 1 --pilot {study}",
    "study plan --margin 5 --level-spread -1",
]

Command = tuple[str, ...]


def _leaves(group: object, name: Command = ()) -> dict[str, list]:
    if not hasattr(group, "commands"):
        return {" ".join(name): list(group.params)}
    found = {}
    for word, inner in group.commands.items():
        found |= _leaves(inner, (*name, word))
    return found


def options() -> dict[str, list]:
    """Parameters of each command, as typer knows them."""
    return _leaves(command_parser())


def _wrong(command: str, name: str) -> list[str] | None:
    for key in (f"{command} {name}", name):
        if key in WRONG:
            return WRONG[key]
    return FLAG if name in FLAGS else None


def undescribed() -> list[str]:
    """Options that no table describes."""
    return [
        f"{command} {each.name}"
        for command, found in options().items()
        for each in found
        if _wrong(command, each.name) is None
    ]


def _without(words: list[str], option: str) -> list[str]:
    """Leave an option and its value out."""
    if option not in words:
        return words
    place = words.index(option)
    return words[:place] + words[place + 2 :]


def _uses() -> list[list[str]]:
    made = [line.split() for line in TOGETHER]
    for command, found in options().items():
        place = 0
        for each in found:
            argument = not each.opts[0].startswith("-")
            for value in _wrong(command, each.name) or []:
                if (command, each.name, value) in RIGHT_THERE:
                    continue
                words = RIGHT[command].split()
                extra = WITH.get(f"{command} {each.name}", "").split()
                if command in ("track", "pick") and each.name in ARM:
                    words[-1] = "ikns"
                    for name, right in (
                        ("subject", "{person}"),
                        ("source", "replay:{free}"),
                    ):
                        if name != each.name and f"--{name}" not in extra:
                            extra += [f"--{name}", right]
                if command in ("check", "ik") and "--static" in extra:
                    words = _without(words, "--subject")
                if "--live" in extra:
                    words = _without(_without(words, "--static"), "--exploration")
                if argument:
                    arguments = [w for w in words if not w.startswith("--")]
                    if place < len(arguments) and words[place] == arguments[place]:
                        words[place] = value
                    else:
                        words.insert(place, value)
                    words += extra
                else:
                    for word in each.opts:
                        words = _without(words, word)
                    words += [*extra, each.opts[-1], value]
                made.append([*command.split(), *words])
            place += argument
    return made


ALL = _uses()
