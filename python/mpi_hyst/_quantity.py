"""The quantity in a column of a record: its name and its unit.

The unit is in the name of the column, as in `drive_v`, `Time (us)`, `Displacement, nm` or `Weg in
Nanometer`, or was given beside it: in a row below the header, or as an attribute of the column.
What a name seems to say of a unit, and what was not used, is `Quantity.unused`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "d": 86400.0}
TIME_NAMES = ("time", "t", "x_value", "timestamp", "elapsed time", "zeit", "temps", "tiempo",
              "datetime", "date time", "date/time", "time stamp", "tempo", "elapsed",
              "zeitstempel", "时间", "時間")  # fmt: skip

_UNITS = {
    unit.lower(): unit
    for unit in (
        *("V", "mV", "kV", "A", "mA", "C", "nC", "uC"),
        *("m", "mm", "um", "nm", "pm", "rad", "mrad", "urad", "deg", "N", "mN", "mT", "uT"),
        *("inch", "mil", "angstrom", "arcsec", "%", "ppm", "counts", "degC", "bar", "mbar"),
        *("V/m", "kV/m", "kV/mm", "A/m", "kA/m"),
        *SECONDS,
    )
} | {"å": "angstrom", "°c": "degC"}
# In small letters these would be units of another size.
_EXACT = {unit: unit for unit in ("MV/m", "MPa", "Nm")}
# A unit that is stated like this is mega, not milli; `DRIVE_MV` is a name in capitals.
_MEGA = ("MV", "MA", "MN")
# Units in words of several languages: each with each prefix, as far as the unit is a known one.
_PREFIXES = {"pico": "p", "nano": "n", "micro": "u", "mikro": "u", "milli": "m", "mili": "m",
             "kilo": "k", "chilo": "k", "quilo": "k", "": ""}  # fmt: skip
_BASES = {
    "m": ("meter", "meters", "metre", "metres", "metern", "m\u00e8tre", "m\u00e8tres", "metro",
          "metros", "metri"),
    "V": ("volt", "volts", "volte", "voltios", "voltio"),
    "A": ("ampere", "amperes", "amp", "amps", "amp\u00e8re", "amp\u00e8res", "amperio", "amperios"),
    "s": ("sec", "secs", "second", "seconds", "sekunde", "sekunden", "seconde", "secondes",
          "segundo", "segundos", "secondo", "secondi"),
    "rad": ("radian", "radians", "radiant"),
    "N": ("newton", "newtons"),
    "T": ("tesla",),
    "C": ("coulomb", "coulombs"),
    "bar": ("bar", "bars"),
}  # fmt: skip
_WORDS = {
    **{
        prefix + word: symbol + base
        for base, words in _BASES.items()
        for word in words
        for prefix, symbol in _PREFIXES.items()
        if (symbol + base).lower() in _UNITS
    },
    **dict.fromkeys(("micron", "microns", "mikron", "micr\u00f3metros", "micr\u00f3metro"), "um"),
    **dict.fromkeys(("nan\u00f3metros", "nan\u00f3metro"), "nm"),
    **dict.fromkeys(("millim\u00e8tres", "mil\u00edmetros"), "mm"),
    **dict.fromkeys(("celsius", "deg c"), "degC"),
    **dict.fromkeys(("degree", "degrees", "grad"), "deg"),
    **{"voltage": "V", "vdc": "V", "percent": "%", "count": "counts", "cts": "counts"},
    **{"arcsecond": "arcsec", "arcseconds": "arcsec", "\u00e5ngstr\u00f6m": "angstrom"},
    **{"angstroms": "angstrom", "msec": "ms", "usec": "us", "nsec": "ns", "minute": "min"},
    **{"minutes": "min", "minuten": "min", "minutos": "min", "hour": "h", "hours": "h"},
    **{"stunden": "h", "heures": "h", "hr": "h", "hrs": "h", "day": "d", "days": "d"},
    **{"毫秒": "ms", "微秒": "us", "秒": "s", "伏": "V", "伏特": "V", "毫伏": "mV"},
    **dict.fromkeys(
        ("inches", "zoll", "pouce", "pouces", "pollici", "pulgada", "pulgadas"), "inch"
    ),
    **dict.fromkeys(("mils", "thou", "thous"), "mil"),
    **{"мкм": "um", "нм": "nm", "мм": "mm", "м": "m", "мВ".lower(): "mV", "кв": "kV", "в": "V"},
    **{"с": "s", "мс": "ms", "мкс": "us", "нс": "ns", "мин": "min", "ч": "h"},
    **{"微米": "um", "纳米": "nm", "毫米": "mm"},
}
# The word of a quantity is no unit of its column, though it tells what unit may be meant.
_OF_QUANTITY = {
    **dict.fromkeys(("voltage", "spannung", "tension", "tensione", "voltaje", "tensi\u00f3n"), "V"),
    **dict.fromkeys(("current", "strom", "courant", "corriente", "corrente"), "A"),
}
_MICRO = ("um", "us", "urad", "uC", "uT")
_SHOWN = {"degC": "°C", "angstrom": "Å", **{unit: f"µ{unit[1:]}" for unit in _MICRO}}
# A column `position_min` holds a minimum and `gain_h` no hours: so only behind a name of time.
_ONLY_OF_TIME = ("ns", "min", "h", "d")
_BEHIND = re.compile(
    r"(?P<name>.*?\S)[\s_]*([\[{<](?P<a>[^\]}>]*)[\]}>]|\((?P<b>[^)]*)\)|\s/\s*(?P<c>\S+))"
)
# A unit before other words of the name: `Position (nm) CH2`.
_INSIDE = re.compile(r"(?P<name>.*?\S)\s*[\[(](?P<unit>[^\])]*)[\])](?P<rest>.+)")
# `Position nm`, `Time, ms`, `pos-nm`, `Weg in nm`, `drive_v`.
_LAST = re.compile(
    r"(?P<name>.*?[^\s_,;:-])(?P<mark>\s*[,;:]\s*|\s+(in|en|em)\s+|[-_]|\s+)(?P<unit>[^\s_,;:-]+)"
)
_IN = re.compile(r"(in|en|em)\s+", re.IGNORECASE)
# What a unit is multiplied with: `(x10 V)`, `(10 nm)`, `[V] x20`, `[nm]/10`, `(um*10)`. Nothing is
# converted: the factor stays with the unit.
_NUMBER = r"\d+([.,]\d+)?([eE][+-]?\d+|\^[+-]?\d+)?"
_TIMES = re.compile(rf"([x×*·]\s*{_NUMBER}|{_NUMBER})\s*[x×*·]?\s*(?P<unit>[^\W\d_].*)")
_TIMES_BEHIND = re.compile(rf"(?P<unit>[^\W\d_%]+)\s*[x×*·/]\s*{_NUMBER}")
_SCALED = re.compile(
    rf"(?P<name>.*?\S)[\s_]*[\[({{<](?P<unit>[^\])}}>]*)[\])}}>]\s*(?P<factor>[x×*·/]\s*{_NUMBER})"
)
_FACTOR = re.compile(rf"[×*·/]\s*{_NUMBER}|(?<=[\s(\[])x\s?{_NUMBER}\b|\b{_NUMBER}\s?[×*]")
# What pandas puts behind the name of a column that comes again.
_AGAIN = re.compile(r"(?<=[^\W\d_])\.\d+$")
# Letters that often name an axis, a channel or a place: `PosFbk(A)`, `sensor C`.
_LETTERS = ("A", "C", "N", "h", "d", "m", "s")
# `I/mA` and `Weg/µm` are quantities over units; `scope/A` may be a path.
_OVER = re.compile(r"(?P<name>[^/]*[^/\s])/(?P<unit>[^/\s]+)")
_SYMBOL = re.compile(r"[^\W\d_](_\w+|\d+)?")
# `encoder/counts` may be a path, too.
_ONLY_OF_SYMBOL = ("counts",)
# What stands in parentheses may be a remark: `pos (raw)`. So there a unit must look like one.
_ONE = (
    r"([pnuµμmckMG]?(m[23]?|g|s2?|A|V|K|N|J|W|T|Pa|Hz|bar|rad|eV|[oO]hm|Ω|Oe|ε|strain)|°F?|degF|psi"
    r"|rpm|dB|a\.?u\.?|arcmin|LSB|digits?|steps?|px|pixels?|turns?|1)(\^-?\d|-[12]|[²³])?"
)
_LIKE_A_UNIT = re.compile(rf"{_ONE}([/*·.]{_ONE})*")


def known_unit(text: str) -> str:
    """Return a unit in ASCII as column names end with it, or nothing: `[µm]` and `um` are um."""
    bare = _bare(text)
    if bare in _MEGA:
        return ""
    return _unit(bare) or _WORDS.get(bare.lower(), "")


def stated_unit(text: str) -> str:
    """Return a unit that is stated: a known one in ASCII, else its text.

    Numbers, as of a channel, and dashes are none.
    """
    bare = _IN.sub("", " ".join(text.strip().strip("[]()").replace("μ", "µ").split()), count=1)
    if bare == "in":
        return "inch"
    return known_unit(text) or (bare if re.search(r"[^\W\d_]|[%‰°]", bare) else "")


def _bare(unit: str) -> str:
    bare = unit.strip().strip("[]()").strip().replace("µ", "u").replace("μ", "u")
    return _AGAIN.sub("", _IN.sub("", bare, count=1).strip())


def _unit(bare: str) -> str:
    return _EXACT.get(bare, _UNITS.get(bare.lower(), ""))


def is_like_a_unit(text: str) -> bool:
    """Whether a text is a known unit, or is written as units are: mW, 1/s, steps, 10 nm."""
    bare = text.strip()
    times = _TIMES.fullmatch(bare) or _TIMES_BEHIND.fullmatch(bare)
    bare = times["unit"] if times is not None and known_unit(times["unit"]) else bare
    return known_unit(bare) != "" or bare == "in" or _LIKE_A_UNIT.fullmatch(bare) is not None


# What stands in parentheses and is no unit: a remark, as `pos (raw)` or `pos (ch 1)`. Anything else
# of one short word may be a unit that nobody here knows.
_REMARK = re.compile(
    r".*\d.*|[a-z]|\w{9,}|raw|real|ideal|true|avg|mean|average|median|rms|min|max|std|filt(ered)?|abs"
    r"|rel(ative)?|lowpass|smooth(ed)?|corr|cal|calib|uncal|scaled|norm|normed|cmd|command|meas"
    r"|measured|actual|ist|soll|set|setpoint|target|ref|out|output|input|left|right|top|bottom|upper"
    r"|lower|open|closed|loop|ol|cl|fwd|bwd|up|down|new|old|sim|model|fit|test|main|monitor|mon|piezo"
    r"|stage|sensor|gauge|probe|drive|voltage|spannung|tension|current|strom|time|none|n/?a|roh|weg"
    r"|axis|cap|strain|sg|lvdt|adc|dac|in phase|[xyz]+[ -]?axis|channel|chan|index",
    re.IGNORECASE,
)
# `nanom`, `nmeter`, `Vpp`, `V rms`, `n m`: a known unit with something more or something less.
_NEARLY = re.compile(
    r"(pico|nano|micro|mikro|milli)[ -]?(m|v|s|met\w*)|[pnuµm][ -]?met(er|re)s?"
    r"|[num]?V[ _-]?(pp|p-p|pk|pkpk|rms|eff|dc|ac)|[pnuµm]\s+[mVs]",
    re.IGNORECASE,
)


def _unknown(column: str) -> str:
    """Return what in a name may be a unit that is not known; empty if nothing is."""
    for found in re.finditer(r"[\[({<](?P<within>[^\])}>]*)[\])}>]", column):
        within = " ".join(found["within"].split())
        word = within.strip(".")
        if _NEARLY.fullmatch(word):
            return within
        is_one = re.fullmatch(r"[^\W\d_]+", word) is not None
        if is_one and not _REMARK.fullmatch(word) and not known_unit(word):
            return within
    if column.endswith((" /", " [", " (")):
        # What stood behind it is lost.
        return column[-1]
    words = re.split(r"[\s_,;:()\[\]-]+", column)
    return next((word for word in words[1:] if _NEARLY.fullmatch(word)), "")


def _behind(column: str) -> tuple[str, str] | None:
    """Return name and unit of a column that ends with it: `T [degC]`, `T (degC)`, `T / degC`."""
    found = _BEHIND.fullmatch(column)
    if found is None:
        return None
    other = found["b"] or found["c"] or ""
    if _may_be_an_axis(found["name"], other, column):
        return None
    unit = stated_unit(found["a"] or (other if is_like_a_unit(other) else ""))
    return (found["name"], unit) if unit else None


def _scaled(column: str) -> tuple[str, str] | None:
    """Return name and unit of a column with a factor behind the unit: `[V] x20`, `[nm]/10`."""
    found = _SCALED.fullmatch(column)
    if found is None or not known_unit(found["unit"]):
        return None
    blank = " " if found["factor"][0] not in "/*" else ""
    return found["name"], f"{known_unit(found['unit'])}{blank}{found['factor']}"


def _may_be_an_axis(name: str, unit: str, column: str) -> bool:
    """Whether a letter may name an axis: `PosFbk(A)`, but not `I (A)` nor `Current(A)`."""
    if unit not in ("A", "C") or not column.endswith(f"{name}({unit})"):
        return False
    words = words_of(name)
    of_current = any(word.lower() in _OF_QUANTITY or word.lower() in _AMPERES for word in words)
    return not (of_current or _SYMBOL.fullmatch(name))


_AMPERES = ("i", "amp", "charge", "ladung", "q", "coil", "电流")


def _inside(column: str) -> tuple[str, str] | None:
    """Return name and unit of a column with a known unit in brackets before other words."""
    found = _INSIDE.fullmatch(column)
    unit = "" if found is None else known_unit(found["unit"])
    if found is None or not unit or unit in _LETTERS:
        return None
    return f"{found['name']} {found['rest'].strip()}", unit


def _last(column: str, mark_before: str = "") -> tuple[str, str] | None:
    """Return name and unit of a column whose last word is one: `Position nm`, `drive_v`."""
    found = _LAST.fullmatch(column)
    if found is None or mark_before not in found["mark"]:
        return None
    name, mark, word = found["name"], found["mark"].strip(), found["unit"]
    bare = _bare(word)
    unit = "" if word.lower() in _OF_QUANTITY else _unit(bare) or _WORDS.get(bare.lower(), "")
    # A unit of its own, as the name says in words, goes before what the letters may be.
    is_time = name.strip().lower() in TIME_NAMES
    *before, prefix = re.split(r"[\s_-]+", name)
    if before and unit and prefix.lower() in _PREFIXES:
        return name.removesuffix(prefix).rstrip(" _-"), known_unit(_PREFIXES[prefix.lower()] + unit)
    if mark == "_":
        # `x_bar` is a mean.
        if (unit in _ONLY_OF_TIME and not is_time) or (unit == "bar" and name in ("x", "y", "u")):
            return None
        return (name, unit) if unit else None
    if unit in ("min", "bar", "d", "h") and not is_time and mark not in (",", ";", ":"):
        return None
    if bare in _LETTERS and mark not in (",", ";", ":", "in", "en", "em") and not is_time:
        return None
    if bare in _MEGA or (len(bare) == 1 and bare not in ("V", "%", *_LETTERS)):
        return None
    return (name, unit) if unit else None


def words_of(column: str) -> list[str]:
    """Return the words of a name: `PosNm`, `pos_nm2` and `pos-nm` have two each."""
    words: list[str] = []
    for word in re.split(r"[^\w%°]+|_|(?<=[^\W\d_])(?=\d)|(?<=\d)(?=[^\W\d_])", column):
        glued = None if word.lower() in _ENDS_IN_MM else _GLUED.fullmatch(word)
        if glued is not None and known_unit(word) == "":
            words += [glued["name"] or glued["time"], glued["unit"] or glued["of_time"]]
            continue
        is_whole = known_unit(word) != ""
        words += [word] if is_whole else re.split(r"(?<=[a-z])(?=[A-Z])", word)
    return [word for word in words if word]


def _over(column: str) -> tuple[str, str] | None:
    """Return name and unit of a quantity over its unit: `I/mA`, `Zeit/s`."""
    found = _OVER.fullmatch(column)
    if found is None:
        return None
    name, bare = found["name"], _bare(found["unit"])
    unit = bare if bare in _MEGA else _unit(bare)
    is_told = len(unit) > 1 and unit not in _ONLY_OF_SYMBOL
    is_told = is_told or _SYMBOL.fullmatch(name) is not None
    if name.lower() in TIME_NAMES or (is_told and unit not in _ONLY_OF_TIME):
        return (name, unit) if unit else None
    return None


def _meant(word: str) -> str:
    """Return the unit that a word of a name seems to mean."""
    return known_unit(word) or _OF_QUANTITY.get(word.lower(), "")


def _says_a_unit(word: str) -> bool:
    """Whether a word of a name is hardly anything but a unit, or a quantity that has one."""
    low = word.lower()
    if low in _OF_QUANTITY:
        return True
    if len(word) == 1:
        return word == "V"
    return known_unit(word) != "" and low not in _NO_UNIT_IN_A_NAME


# `Wegnm`, `timems`: a unit behind a word, without anything between. Words end in um, ms and us.
_GLUED = re.compile(
    r"(?P<name>\w{2,})(?P<unit>nm|mm|kV|mV)|(?P<time>t|time|zeit|temps)(?P<of_time>ms|us|ns)",
    re.IGNORECASE,
)
_ENDS_IN_MM = ("programm", "gramm", "kilogramm", "diagramm")
# Words of names that are units elsewhere: a minimum, a mean, a number of samples.
_NO_UNIT_IN_A_NAME = (
    *("min", "bar", "count", "counts", "amp", "amps", "grad", "day", "days", "hour", "second"),
    *("sec", "hr", "ma", "nc", "mt"),
)


_TOLD = re.compile(r"[\[({<](?P<within>[^\])}>]*)[\])}>]|(?P<word>[^\s:=;,|()\[\]{}<>\"]+)")
_SAYS_NEXT = re.compile(r"([:=;,|\t]|\b(in|en|em))\s*$", re.IGNORECASE)
_OF_UNIT = re.compile(r"\b(unit|einheit|unité|unidad)", re.IGNORECASE)


_CONVERSION = re.compile(
    rf"{_NUMBER}\s*(?P<a>[^\W\d_]+)\s*(?:=|/|≙|per|pro|par|for|is|corresponds? to|entspricht)\s*"
    rf"(?:{_NUMBER}\s*)?(?P<b>[^\W\d_]+)(?![\w/])",
    re.IGNORECASE,
)


def conversion(text: str) -> str:
    """Return what a line of text says of one unit in another: `10 V = 30 um`, `3 um/V`."""
    found = _CONVERSION.search(text)
    if found is None:
        return ""
    one, other = known_unit(found["a"]), known_unit(found["b"])
    is_rate = other in SECONDS
    return found[0] if one and other and one != other and not is_rate else ""


def units_told(text: str) -> list[str]:
    """Return the units that a line of text holds, but for those of numbers: `Travel 100 um`."""
    told = []
    for found in _TOLD.finditer(text):
        before, behind = text[: found.start()], text[found.end() :]
        word = (found["within"] or found["word"] or "").rstrip(".!?")
        unit = known_unit(word)
        times = _TIMES.fullmatch(word)
        if found["within"] is not None and times is not None:
            unit = known_unit(times["unit"])
        elif found["within"] is not None and not unit:
            told += units_told(word)
        if not unit or re.search(r"\d[\s\"]*$", before) or re.match(r"\s*[\d/]", behind):
            continue
        low = word.lower()
        is_stated = found["within"] is not None or _OF_UNIT.search(before) is not None
        if not is_stated and (low in _OF_QUANTITY or low in _NO_UNIT_IN_A_NAME):
            continue
        says_next = _SAYS_NEXT.search(before) is not None
        if not is_stated and (len(word) == 1 or low == "us") and not (says_next and word == "V"):
            continue
        told.append(unit)
    return list(dict.fromkeys(told))


def with_unit(name: str, unit: str) -> str:
    """Return the name of a column that says its unit: position_um, or position [mV/m]."""
    stated = stated_unit(unit)
    if not stated:
        return name
    is_ending = known_unit(stated.lower()) == stated and stated.isalnum()
    return f"{name}_{stated.lower()}" if is_ending else f"{name} [{stated}]"


def drive_with_unit(unit: str) -> str:
    """Return the name of the column of a drive: `drive` for V, as in any name without a unit."""
    return "drive" if known_unit(unit) == "V" else with_unit("drive", unit)


@dataclass(frozen=True)
class Quantity:
    """A quantity by the name of its column: `displacement_um` is a displacement in µm.

    `given` is the unit that the file states beside the name; it goes before that in the name.
    """

    column: str
    given: str = ""

    @property
    def suffix(self) -> str:
        """The unit: um, in ASCII if it is known, else as it is stated. Empty if there is none."""
        return stated_unit(self.given) or self._parts[1]

    @property
    def time_unit(self) -> str:
        """The unit if it is one of time; empty if it is none."""
        return self.suffix if self.suffix in SECONDS else ""

    @property
    def unit(self) -> str:
        """The unit as text shows it: µm."""
        return _SHOWN.get(self.suffix, self.suffix)

    @property
    def name(self) -> str:
        """The name without the unit."""
        return self._parts[0].replace("_", " ")

    @property
    def label(self) -> str:
        """The name with its unit, for an axis: displacement (µm)."""
        return f"{self.name} ({self.unit})" if self.suffix else self.column

    @property
    def in_parentheses(self) -> str:
        """The unit for the end of a label or of a column header: a space and (µm), or nothing."""
        return f" ({self.unit})" if self.unit else ""

    @property
    def is_time(self) -> bool:
        """Whether the name says that this is the time: time, `t_ms`, `Time (us)`, but not `t`."""
        name = self._parts[0].strip().lower()
        unit = known_unit(self.given) or self._parts[1]
        return name in TIME_NAMES and (unit in SECONDS or (name != "t" and not unit))

    @property
    def unused(self) -> str:
        """What the name holds of a unit that was not taken from it; empty if there is none.

        `PosNm` may be in nm, and `Sensor voltage` in V.
        """
        used = self.suffix
        words = words_of(self.column.strip().replace("µ", "u").replace("μ", "u"))
        found = [word for word in words if _says_a_unit(word)]
        # What is written like a unit says more than the word of a quantity.
        found.sort(key=lambda word: word.lower() in _OF_QUANTITY)
        meant = [_meant(word) for word in found]
        letter = re.search(r"[\[(]([A-Za-z])[\])]", self.column)
        if letter is not None and not used and letter[1] in ("A", "C"):
            found, meant = [*found, letter[1]], [*meant, letter[1]]
        if used:
            # In other units than that which was taken: `x_um` below nm.
            others = [
                word
                for word, unit in zip(found, meant, strict=True)
                if unit != used and word.lower() not in _OF_QUANTITY
            ]
            return others[0] if others and known_unit(used) else ""
        unknown = "" if used else _unknown(self.column)
        return found[0] if found and not (unknown and self._is_of_quantity(found[0])) else unknown

    @staticmethod
    def _is_of_quantity(word: str) -> bool:
        return word.lower() in _OF_QUANTITY

    @property
    def factor(self) -> str:
        """A factor in the name that is not in the unit; empty if there is none."""
        found = _FACTOR.search(self.column, 1)
        has_unit = self.suffix or self.unused
        return found[0].strip() if found and has_unit and found[0] not in self.suffix else ""

    @property
    def meant(self) -> str:
        """The unit that what was not used seems to mean."""
        return _meant(self.unused)

    @property
    def is_word(self) -> bool:
        """Whether the name says what is measured, as a voltage, and no unit of it."""
        return self.unused.lower() in _OF_QUANTITY

    @property
    def _parts(self) -> tuple[str, str]:
        """The name without the unit, and the unit that it ends with."""
        column = self.column.strip()
        found = _scaled(column) or _behind(column) or _inside(column) or _last(column, "_")
        found = found or _over(column) or _last(column)
        if found is not None:
            return found
        bare = _bare(column)
        # A column that is called like its unit.
        alone = known_unit(column) if len(bare) > 1 or bare == "V" else ""
        is_alone = alone and bare.lower() not in (*_OF_QUANTITY, *_AMPERES, "min", "bar", "count")
        return (self.column, alone if is_alone else "")


@dataclass(frozen=True)
class Stated(Quantity):
    """A quantity whose unit a user states: any text, or nothing."""

    @property
    def suffix(self) -> str:
        """The unit in ASCII where it is a known one, else as it was stated."""
        return known_unit(self.given) or self.given.strip()
