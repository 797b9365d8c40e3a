#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""misra.py - the five headers under MISRA C:2012, as far as cppcheck's addon checks it. Last line: N passed, N failed.

    misra.py        findings against the record misra.txt, and docs/misra.md against both
    misra.py -w     first writes the counts of today into the record, and docs/misra.md anew: look at the difference, for a rule
                    whose count grew needs the reason that stands there
    misra.py -l R   the findings of rule R, with their lines

A finding is a rule, a file and a line. Looked at are the models of options.h as firmware compiles them (ROLN_SIMD 0, ints and
pointers of 32 bits), as float and as double; and, for rules of single characters and words, of which the
addon reads those of a file itself but not those of what it includes, each header as a file of its own.

misra.txt has a block for every rule of the addon: `rule NUMBER CATEGORY DECISION text`, then the reason, then the places,
`at HEADER COUNT [functions]`. Decisions:

    kept         required and mandatory rules, and advisory ones that are kept: no finding
    deviation    findings are true and stay, for the reason given; of no header may there be more than are recorded
    tool         findings are errors of the tool, for the reason given; counted like deviations
    disapplied   an advisory rule that is not followed: findings are counted, and may grow
"""
import collections
import os
import re
import shutil
import subprocess
import sys

from headers import HEADERS, named

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), '..', '..'))
GUARDS = [h.upper().replace('.', '_') for h in HEADERS]
BUILD = 'build/misra'
RECORD = 'tests/safety/misra.txt'
TEXT = 'docs/misra.md'
NAMED = 8  # findings of a rule in a header up to which their functions are named
# what cppcheck's library lacks: the suffixes of constants of stdint.h
COMMON = ['-q', '--std=c99', '--platform=unix32', '-I.', '-DROLN_SIMD=0', '-DUINT32_C(x)=x##U', '-DUINT64_C(x)=x##ULL']
UNREAD = re.compile(r'\[(unknownMacro|syntaxError|preprocessorErrorDirective|internalAstError|internalError|cppcheckError)\]')
NAMES = {'kept': 'kept', 'deviation': 'deviation', 'tool': 'errors of the tool', 'disapplied': 'disapplied'}
INTRODUCTION = '''
# MISRA C:2012

Written by `python3 tests/safety/misra.py -w` from the findings of a tool and from `tests/safety/misra.txt`, where what is decided
stands; change that file, not this one. `sh tests/run.sh misra` compares them: it fails where a rule has a finding without a
record, where a required rule has more findings than are recorded, and where a record has none any more.

The tool is the addon misra.py of cppcheck (Debian's 2.10). It checks a part of the rules, those below, and of undecidable ones the
decidable part. So this is no claim of compliance with MISRA C:2012; it is the list of what a project that must comply has to
permit for these headers, with reasons, and it does not grow unseen. The words on a rule are ours; the rules are MISRA's, and its
documents are to be had from MISRA alone. Categories are those of MISRA C:2012 with its amendments 1 and 2.

The addon reads the five headers in a translation unit that has every option of a config (`tests/safety/options.h`), as float and
as double. The target has 32 bits. The SIMD of hosts is off (`ROLN_SIMD` 0), since no microcontroller compiles it. A finding is a
rule, a file and a line. The addon checks rules 8.2 and 9.5 in part; gcc's -Wstrict-prototypes checks the rest of the prototypes.

*Deviation*: findings are true and stay, for the reason given. *Errors of the tool*: the rule is kept, and why. *Disapplied*: an
advisory rule that this project does not follow; such findings are counted, and may grow.
'''


def addon():
    for root in ('/usr/lib/x86_64-linux-gnu', '/usr/lib', '/usr/share', '/usr/lib/' + os.uname().machine + '-linux-gnu'):
        path = root + '/cppcheck/addons/misra.py'
        if os.path.exists(path):
            return path
    sys.exit('cppcheck and its addon misra.py are not there: make release-deps')


def order(rule):
    return [int(n) for n in rule.split('.')]


def checked():
    """The rules that the addon checks, and those of them that read the words of a file itself: its calls of executeCheck."""
    with open(addon(), encoding='utf-8') as f:
        calls = re.findall(r'executeCheck\((\d\d?)(\d\d),(.*)\)', f.read())
    calls = [('%d.%d' % (int(chapter), int(number)), what) for chapter, number, what in calls]
    return sorted({rule for rule, _ in calls}, key=order), {rule for rule, what in calls if 'rawTokens' in what}


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, check=False)


def measure():
    """{rule: {header: {line}}}, and what could not be read."""
    shutil.rmtree(BUILD, ignore_errors=True)
    os.makedirs(BUILD)
    sources = []
    for name, options in (('float.c', ['-DROLN_STANDARD']), ('double.c', ['-DROLN_DOUBLE'])):
        with open(BUILD + '/' + name, 'w', encoding='utf-8') as f:
            f.write('#include "tests/safety/options.h"\n')
        sources.append((BUILD + '/' + name, options))
    for h in HEADERS:  # behind their guards nothing is left but words, and a line for the tool to start at
        with open(h, encoding='utf-8') as f, open(BUILD + '/' + h, 'w', encoding='utf-8') as copy:
            copy.write(f.read() + 'extern int rolni_word;\n')
        sources.append((BUILD + '/' + h, ['-D' + g for g in GUARDS]))
    said, words, unread = '', '', []
    for source, options in sources:
        out = run('cppcheck', *COMMON, *options, '--language=c', '--dump', source)
        unread += [line for line in (out.stdout + out.stderr).splitlines() if UNREAD.search(line)]
        out = run(sys.executable, addon(), '--no-summary', source + '.dump')
        if source.endswith('.c'):
            said += out.stdout + out.stderr
        else:
            words += out.stdout + out.stderr
    # unused macros, types and tags
    out = run(sys.executable, addon(), '--no-summary', sources[0][0] + '.ctu-info')
    said += out.stdout + out.stderr
    unread += re.findall(r'^Traceback.*|^\w*Error: .*', said + words, re.M)
    findings = collections.defaultdict(lambda: collections.defaultdict(set))
    for text, rules in ((said, None), (words, checked()[1])):
        for path, line, rule in re.findall(r'^\[(.+?):(\d+)\].*\[misra-c2012-([\d.]+)\]', text, re.M):
            if os.path.basename(path) in HEADERS and (rules is None or rule in rules):
                findings[rule][os.path.basename(path)].add(int(line))
    return findings, unread


def functions():
    """{header: [(first line, last line, name)]}, of functions and macros."""
    found = {}
    for h in HEADERS:
        stripped = run('awk', '-f', 'tests/style/strip.awk', h).stdout
        with open(BUILD + '/stripped', 'w', encoding='utf-8') as f:
            f.write(stripped)
        rows = run('awk', '-v', 'file=' + h, '-f', 'tests/style/functions.awk', BUILD + '/stripped').stdout
        found[h] = []
        for row in rows.splitlines():
            _, first, name, length = row.split()[:4]
            name = named(name)
            found[h].append((int(first), int(first) + int(length) - 1, name))
        first = name = None
        for number, line in enumerate(stripped.split('\n'), 1):
            m = re.match(r'#define (\w+)', line)
            if m:
                first, name = number, m[1]
            if name:
                found[h].append((number, number, name))
                if not line.endswith('\\'):
                    name = None
    return found


def places(lines, spans):
    """Names of the functions and macros that these lines are in, `a function (count)`."""
    count = collections.Counter()
    for line in sorted(lines):
        inside = [name for first, last, name in spans if first <= line <= last]
        count[inside[-1] if inside else 'outside of functions'] += 1
    return ', '.join(name if n == 1 else '%s (%d)' % (name, n) for name, n in count.items())


class Rule:
    def __init__(self, head):
        self.number, self.category, self.decision, self.text = head.split(None, 3)
        self.why = []
        self.at = {}  # header: count, names

    def block(self):
        lines = ['rule %s %s %s %s' % (self.number, self.category, self.decision, self.text)] + self.why
        return lines + [('at %s %d %s' % (h, *self.at[h])).rstrip() for h in HEADERS if h in self.at]


def read():
    """The comment at the head of the record, and its rules."""
    head, rules = [], []
    with open(RECORD, encoding='utf-8') as f:
        for line in f.read().splitlines():
            if line.startswith('rule '):
                rules.append(Rule(line[5:]))
            elif not rules:
                head.append(line)
            elif line.startswith('at '):
                _, header, count, names = (line + ' ').split(' ', 3)
                rules[-1].at[header] = (int(count), names.strip())
            elif line:
                rules[-1].why.append(line)
    return head, rules


def write(head, rules):
    with open(RECORD, 'w', encoding='utf-8') as f:
        f.write('\n'.join(head) + '\n')
        for r in rules:
            f.write('\n'.join(r.block()) + '\n' + ('\n' if r.why else ''))


def report(rules):
    """docs/misra.md, of the record alone."""
    total = collections.Counter()
    for r in rules:
        n = sum(count for count, _ in r.at.values())
        total[r.category, r.decision] += n
        total[r.category] += n
        total['rules', r.category] += 1
        total['followed', r.category] += n == 0
    out = [INTRODUCTION.strip(), '', '| | rules | without a finding | findings | deviations | errors of the tool | disapplied |',
           '|---|---|---|---|---|---|---|']
    for c in ('mandatory', 'required', 'advisory'):
        out.append('| %s | %d | %d | %d | %d | %d | %d |' % (c, total['rules', c], total['followed', c], total[c],
                   total[c, 'deviation'], total[c, 'tool'], total[c, 'disapplied']))
    out += ['', '## Rules with findings', '', '| rule | category | about | findings | decision |', '|---|---|---|---|---|']
    for r in rules:
        if r.at:
            out.append('| [%s](#rule-%s) | %s | %s | %d | %s |' % (r.number, r.number.replace('.', ''), r.category, r.text,
                       sum(count for count, _ in r.at.values()), NAMES[r.decision]))
    out += ['', '## Rules without a finding', '', '| rule | category | about |', '|---|---|---|']
    out += ['| %s | %s | %s |' % (r.number, r.category, r.text) for r in rules if not r.at]
    out += ['', '## Reasons and places', '',
            'A count stands behind a header, and behind a function or macro that has more than one finding.', '']
    for r in rules:
        if r.at:
            out += ['### Rule %s' % r.number, '', '*%s, %s: %s.*' % (r.text[0].upper() + r.text[1:], r.category,
                    NAMES[r.decision]), '', ' '.join(r.why), '']
            out += ['- `%s` %d%s' % (h, r.at[h][0], ': ' + r.at[h][1] if r.at[h][1] else '') for h in HEADERS if h in r.at]
            out.append('')
    return '\n'.join(out).rstrip() + '\n'


def compare(rules, findings, unread, now):
    """What is wrong, a text each, and how many questions were asked."""
    wrong = ['not read: ' + line for line in unread]
    known = [r.number for r in rules]
    want = checked()[0]
    if known != want:
        wrong.append('rules of the record and of the addon differ: %s' % sorted(set(known) ^ set(want), key=order))
    wrong += ['rule %s has findings and no record' % n for n in sorted(set(findings) - set(known), key=order)]
    asked = 3
    for r in rules:
        if r.category not in ('mandatory', 'required', 'advisory') or r.decision not in NAMES:
            wrong.append('rule %s: %s %s' % (r.number, r.category, r.decision))
        if r.decision == 'disapplied' and r.category != 'advisory' or r.decision == 'deviation' and r.category == 'mandatory':
            wrong.append('rule %s is %s and cannot be %s' % (r.number, r.category, r.decision))
        if (r.decision != 'kept') != bool(r.why):
            wrong.append('rule %s: a reason, where it is not kept' % r.number)
        if r.decision != 'kept' and not findings.get(r.number):
            wrong.append('rule %s has no finding any more: it is kept' % r.number)
        for h in HEADERS:
            n, most = len(findings.get(r.number, {}).get(h, ())), r.at.get(h, (0, ''))[0]
            asked += 1
            if n > most and r.decision != 'disapplied':
                wrong.append('rule %s in %s: %d findings, %d recorded; misra.py -l %s' % (r.number, h, n, most, r.number))
            elif n == 0 and most > 0:
                wrong.append('rule %s in %s has no finding any more: misra.py -w' % (r.number, h))
    if not os.path.exists(TEXT) or open(TEXT, encoding='utf-8').read() != now:
        wrong.append(TEXT + ' is not of this record: misra.py -w')
    return wrong, asked


def main():
    os.chdir(ROOT)
    findings, unread = measure()
    if sys.argv[1:2] == ['-l']:
        for h in HEADERS:
            with open(h, encoding='utf-8') as f:
                text = f.read().split('\n')
            for line in sorted(findings[sys.argv[2]][h]):
                print('%s:%d: %s' % (h, line, text[line - 1].strip()))
        return 0
    head, rules = read()
    if sys.argv[1:] == ['-w']:
        spans = functions()
        for r in rules:
            r.at = {h: (len(lines), places(lines, spans[h]) if len(lines) <= NAMED else '')
                    for h, lines in findings.get(r.number, {}).items() if lines}
        write(head, rules)
        with open(TEXT, 'w', encoding='utf-8') as f:
            f.write(report(rules))
    wrong, asked = compare(rules, findings, unread, report(rules))
    for line in wrong:
        print(line)
    print('%d passed, %d failed' % (max(asked - len(wrong), 0), len(wrong)))
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
