#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""misra.py - the five headers under MISRA C:2012, as far as cppcheck's addon checks it. Last line: N passed, N failed.

    misra.py        compares the findings with the record misra.txt, and docs/misra.md with the record
    misra.py -w     first writes today's counts into the record, and docs/misra.md anew. Look at the difference: the reason of a
                    rule whose count grew must cover the new places
    misra.py -l R   prints the places of rule R; of all rules: -l all

Each run writes the places of all findings to build/misra/places.md. A finding is a rule, a header and a line. The addon reads the
models of options.h as firmware compiles them (ROLN_SIMD 0, ints and pointers of 32 bits), as float and as double. Rules of single
characters and words are checked in each header by itself, because the addon does not apply them to included files.

misra.txt has a block for every rule of the addon: `rule NUMBER CATEGORY DECISION COUNT text`, then the reason. Decisions:

    kept         the rule has no finding
    deviation    findings are true and stay; there may be no more than COUNT
    tool         findings are errors of the tool; there may be no more than COUNT
    disapplied   an advisory rule that is not followed; findings may grow
"""
import collections
import os
import re
import shutil
import subprocess
import sys

from headers import HEADERS

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), '..', '..'))
BUILD = 'build/misra'
PLACES = BUILD + '/places.md'
RECORD = 'tests/safety/misra.txt'
TEXT = 'docs/misra.md'
# what cppcheck's library lacks: the suffixes of constants of stdint.h
COMMON = ['-q', '--std=c99', '--platform=unix32', '-I.', '-DROLN_SIMD=0', '-DUINT32_C(x)=x##U', '-DUINT64_C(x)=x##ULL']
UNREAD = re.compile(r'.*\[(?:unknownMacro|syntaxError|preprocessorErrorDirective|internalAstError|internalError|cppcheckError)\]'
                    r'|^Traceback.*|^\w*Error: .*', re.M)
CATEGORIES = ('mandatory', 'required', 'advisory')
NAMES = {'kept': 'kept', 'deviation': 'deviation', 'tool': 'error of the tool', 'disapplied': 'disapplied'}
INTRODUCTION = '''
# MISRA C:2012

This page lists the MISRA rules that have findings in the five headers, and the reason for each. A project that must comply with
MISRA has to permit these deviations. The page is no claim of compliance.

The addon misra.py of cppcheck 2.10 (Debian 12) finds the places. The addon checks the rules of this page and no others. It checks
the decidable part of undecidable rules, and a part of rules 8.2 and 9.5. gcc's -Wstrict-prototypes checks the rest of rule 8.2.
Categories are those of MISRA C:2012 with amendments 1 and 2. The descriptions of rules are ours. Only MISRA's documents, which
MISRA sells, are authoritative.

The addon reads the models of `tests/safety/options.h`, which have every option of a config, as float and as double. The target has
32 bits, and vector code for PCs is off (`ROLN_SIMD` 0). A finding is a rule, a header and a line.

    sh tests/run.sh misra                      compare the headers with this page
    python3 tests/safety/misra.py -l 10.3      print the places of rule 10.3
    python3 tests/safety/misra.py -l all       print the places of all rules; also written to build/misra/places.md
    python3 tests/safety/misra.py -w           write the counts of today; needed when a count grows

Edit decisions and reasons in `tests/safety/misra.txt`. The last command writes this page from that file. The check fails if

- a rule has findings but no decision and no reason,
- a rule with deviations or errors of the tool has more findings than this page says,
- a rule that has a reason has no finding.

| decision | meaning |
|---|---|
| deviation | The findings are true and stay. |
| error of the tool | The headers keep the rule. |
| disapplied | The project does not follow this advisory rule. The count may grow. |
'''
Rule = collections.namedtuple('Rule', 'number category decision count about why')


def addon():
    for root in ('/usr/lib/x86_64-linux-gnu', '/usr/lib', '/usr/share', '/usr/lib/' + os.uname().machine + '-linux-gnu'):
        path = root + '/cppcheck/addons/misra.py'
        if os.path.exists(path):
            return path
    sys.exit('cppcheck and its addon misra.py are not there: make release-deps')


def content(path):
    with open(path, encoding='utf-8') as f:
        return f.read()


def store(path, text):
    with open(path, 'w', encoding='utf-8') as f:
        f.write(text)


def order(number):
    return [int(n) for n in number.split('.')]


def checked():
    """The rules that the addon checks, and those of them that read the words of a file itself: its calls of executeCheck."""
    calls = re.findall(r'executeCheck\((\d\d?)(\d\d),(.*)\)', content(addon()))
    calls = [('%d.%d' % (int(chapter), int(number)), what) for chapter, number, what in calls]
    return sorted({rule for rule, _ in calls}, key=order), {rule for rule, what in calls if 'rawTokens' in what}


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


def measure():
    """{rule: {(header, line)}}, and what could not be read."""
    shutil.rmtree(BUILD, ignore_errors=True)
    os.makedirs(BUILD)
    sources = {'float.c': ['-DROLN_STANDARD'], 'double.c': ['-DROLN_DOUBLE']}
    for name in sources:
        store(BUILD + '/' + name, '#include "tests/safety/options.h"\n')
    for h in HEADERS:  # behind their guards nothing is left but words, and a line for the tool to start at
        store(BUILD + '/' + h, content(h) + 'extern int rolni_word;\n')
        sources[h] = ['-D' + g.upper().replace('.', '_') for g in HEADERS]
    findings, unread = collections.defaultdict(set), []

    def take(said, rules=None):
        unread.extend(UNREAD.findall(said))
        for path, line, rule in re.findall(r'^\[(.+?):(\d+)\].*\[misra-c2012-([\d.]+)\]', said, re.M):
            if os.path.basename(path) in HEADERS and (rules is None or rule in rules):
                findings[rule].add((os.path.basename(path), int(line)))

    for name, options in sources.items():
        source = BUILD + '/' + name
        unread.extend(UNREAD.findall(run('cppcheck', *COMMON, *options, '--language=c', '--dump', source)))
        take(run(sys.executable, addon(), '--no-summary', source + '.dump'), checked()[1] if name in HEADERS else None)
    take(run(sys.executable, addon(), '--no-summary', BUILD + '/float.c.ctu-info'))  # unused macros, types and tags
    return findings, unread


def places(findings, about):
    """{rule: its places as text}"""
    lines = {h: content(h).split('\n') for h in HEADERS}
    return {n: '## Rule %s: %s, %d\n\n' % (n, about.get(n, 'no record'), len(findings[n])) +
               ''.join('    %s:%d: %s\n' % (h, i, lines[h][i - 1].strip()) for h, i in sorted(findings[n]))
            for n in sorted(findings, key=order)}


def record():
    found = re.findall(r'^rule (\S+) (\S+) (\S+) (\d+) (.*)((?:\n(?!rule ).+)*)', content(RECORD), re.M)
    return [Rule(n, category, decision, int(count), about, ' '.join(why.split()))
            for n, category, decision, count, about, why in found]


def page(rules):
    """docs/misra.md, from the record alone."""
    clean, table = [], []
    out = ['| category | rules | without a finding | findings | deviations | errors of the tool | disapplied |', '|---' * 7 + '|']
    for c in CATEGORIES:
        of = [r for r in rules if r.category == c]
        counts = [sum(r.count for r in of if r.decision in d) for d in (NAMES, ['deviation'], ['tool'], ['disapplied'])]
        kept = [r.number for r in of if r.count == 0]
        out.append('| %s | %d | %d | %d | %d | %d | %d |' % (c, len(of), len(kept), *counts))
        clean.append('- %s: %s' % (c, ', '.join(kept)))
    for r in rules:
        if r.count:
            cells = (r.number, r.category, r.about, str(r.count), NAMES.get(r.decision, '?'), r.why)
            table.append('| ' + ' | '.join(cell.replace('|', '\\|') for cell in cells) + ' |')
    return '\n'.join([INTRODUCTION.strip(), '', *out, '', '## Rules with findings', '',
                      '| rule | category | about | findings | decision | rationale |', '|---' * 6 + '|', *table, '',
                      '## Rules without a finding', '', *clean]) + '\n'


def compare(rules, findings, unread):
    """What is wrong, a text each, and how many questions were asked."""
    wrong = ['not read: ' + line for line in unread]
    known = [r.number for r in rules]
    if known != checked()[0]:
        wrong.append('rules of %s and of the addon differ: %s' % (RECORD, sorted(set(known) ^ set(checked()[0]), key=order)))
    wrong += ['rule %s has findings and no record' % n for n in sorted(set(findings) - set(known), key=order)]
    for r in rules:
        n, kept = len(findings.get(r.number, ())), r.decision == 'kept'
        if (r.category not in CATEGORIES or r.decision not in NAMES or r.decision == 'disapplied' and r.category != 'advisory' or
                r.decision == 'deviation' and r.category == 'mandatory'):
            wrong.append('rule %s: %s, and %s' % (r.number, r.category, r.decision))
        elif kept != (not r.why) or kept != (r.count == 0):
            wrong.append('rule %s is %s: a reason and a count, unless it is kept' % (r.number, r.decision))
        elif n > r.count and r.decision != 'disapplied':
            wrong.append('rule %s: %d findings, %d recorded; places in %s' % (r.number, n, r.count, PLACES))
        elif n == 0 and not kept:
            wrong.append('rule %s has no finding any more: set it to kept' % r.number)
    if not os.path.exists(TEXT) or content(TEXT) != page(rules):
        wrong.append('%s differs from %s: misra.py -w' % (TEXT, RECORD))
    return wrong, 4 + len(rules)


def main():
    os.chdir(ROOT)
    findings, unread = measure()
    if sys.argv[1:] == ['-w']:
        store(RECORD, re.sub(r'^(rule (\S+) \S+ \S+) \d+', lambda m: '%s %d' % (m[1], len(findings.get(m[2], ()))),
                             content(RECORD), flags=re.M))
        store(TEXT, page(record()))
    rules = record()
    at = places(findings, {r.number: r.about for r in rules})
    store(PLACES, '\n'.join(['# Places of findings\n', *at.values()]))
    if sys.argv[1:2] == ['-l']:
        print(content(PLACES) if sys.argv[2] == 'all' else at.get(sys.argv[2], 'no finding'))
        return 0
    wrong, asked = compare(rules, findings, unread)
    print('\n'.join([*wrong, '%d passed, %d failed' % (max(asked - len(wrong), 0), len(wrong))]))
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
