/* SPDX-License-Identifier: MIT */
/* cuts.c - the power goes at every write of a stored adaptation (kept.h), and in the middle of every word: nothing is lost.

   Compiled with -fsanitize=thread, which calls a function before every store, and linked to functions of this file in place of that
   library's, so that the writes of kept_save and kept_open are known one by one, as words of 32 bits, low or high half of 64
   first. A cut leaves the words before it, and of the one at hand any of its four bytes, or any bits. kept_open then must find a
   whole state: the one saved before, or the new one, and the new one for certain once its number is written. So it must if power
   goes again while it recovers, at any of its own writes. First a small state, with everything; then the 42 kB of adapt.c, in the
   middle of its learning, at a save. */
#include <string.h>
static void *copy_words(void *to, const void *from, size_t size);
#define memcpy copy_words
#define main adapt_main
#include "../../examples/firmware/adapt.c"
#undef memcpy
#undef main

/* ---- writes ---- */

enum { MOST = 24000, TORN = 16 + 8 };
typedef struct { uint32_t at, old, new; } write; /* at: of the word, in the memory watched */
static struct {
    unsigned char *begin[2]; /* marks, copies */
    size_t size[2];
    int on, high_first, count, open; /* open: of the last write the values are not known yet */
    write w[MOST];
} trace;

#define APART __attribute__((no_sanitize_thread))

/* A word of what is watched. */
APART static uint32_t *word_at(uint32_t at)
{
    const size_t first = trace.size[0] / 4;
    return (uint32_t *)(void *)(at < first ? trace.begin[0] : trace.begin[1]) + (at < first ? at : at - first);
}

APART static void trace_close(void)
{
    for (; trace.open > 0; trace.open--) {
        write *w = &trace.w[trace.count - trace.open];
        w->new = *word_at(w->at);
    }
}

/* `bytes` at p are about to be written. */
APART static void trace_write(const void *p, size_t bytes)
{
    const unsigned char *b = (const unsigned char *)p;
    if (!trace.on) return;
    trace_close();
    for (uint32_t k = 0; k < 2; k++) {
        if (b < trace.begin[k] || b >= trace.begin[k] + trace.size[k]) continue;
        const uint32_t first = (uint32_t)((size_t)(b - trace.begin[k]) + (k ? trace.size[0] : 0)) / 4, words = (uint32_t)bytes / 4;
        for (uint32_t i = 0; i < words && trace.count < MOST; i++) {
            const uint32_t at = first + (trace.high_first ? words - 1 - i : i);
            trace.w[trace.count].at = at, trace.w[trace.count++].old = *word_at(at), trace.open++;
        }
    }
}

APART static void *copy_words(void *to, const void *from, size_t size)
{
    if (trace.on)
        for (size_t i = 0; i < size; i += 4) {
            trace_write((unsigned char *)to + i, 4);
            memcpy((unsigned char *)to + i, (const unsigned char *)from + i, 4);
        }
    else memcpy(to, from, size);
    return to;
}

/* What the compiler calls. */
#define HOOKS(size) \
    void __tsan_read##size(void *p); \
    void __tsan_unaligned_read##size(void *p); \
    void __tsan_write##size(void *p); \
    void __tsan_unaligned_write##size(void *p); \
    void __tsan_read##size(void *p) { (void)p; } \
    void __tsan_unaligned_read##size(void *p) { (void)p; } \
    APART void __tsan_write##size(void *p) { trace_write(p, size); } \
    APART void __tsan_unaligned_write##size(void *p) { trace_write(p, size); }
HOOKS(1)
HOOKS(2)
HOOKS(4)
HOOKS(8)
HOOKS(16)
void __tsan_init(void);
void __tsan_func_entry(void *p);
void __tsan_func_exit(void);
void __tsan_read_range(void *p, size_t size);
void __tsan_write_range(void *p, size_t size);

void __tsan_init(void) {}

void __tsan_func_entry(void *p)
{
    (void)p;
}

void __tsan_func_exit(void) {}

void __tsan_read_range(void *p, size_t size)
{
    (void)p, (void)size;
}

APART void __tsan_write_range(void *p, size_t size)
{
    trace_write(p, size);
}

static void trace_begin(int high_first)
{
    trace.count = trace.open = 0, trace.high_first = high_first, trace.on = 1;
}

static void trace_end(void)
{
    trace.on = 0;
    trace_close();
}

/* Word w, written in part: variant 0 .. 15 of its bytes, the others of its bits. */
static uint32_t torn(const write *w, int variant)
{
    uint32_t mask = 0;
    for (int b = 0; b < 4; b++)
        if (variant >> b & 1) mask |= UINT32_C(255) << (8 * b);
    if (variant >= 16) mask = UINT32_C(0x9e3779b9) * (uint32_t)(variant + 7 * (int)(w->at % 5));
    return (w->old & ~mask) | (w->new & mask);
}

/* ---- what must be found ---- */

static int bad;
static uint32_t cuts, again; /* power cuts of a save; of the recovery from one */
static void expect(int good, const char *what)
{
    if (good) return;
    if (bad++ < 10) put_text(what), put_text("\n");
}

typedef struct { uint32_t value, fill[11]; } small;
enum { SMALL = 5 }; /* what they go on from */
static kept_mark small_marks[2];
static small small_states[2];

static void small_fill(small *s, uint32_t value)
{
    s->value = value;
    for (uint32_t k = 0; k < 11; k++)
        s->fill[k] = value * UINT32_C(2654435761) + k;
}

static int small_is(const small *s, uint32_t value)
{
    small want;
    small_fill(&want, value);
    return memcmp(s, &want, sizeof want) == 0;
}

typedef struct { kept_mark marks[2]; small states[2]; } image;

static void take(image *m)
{
    memcpy(m->marks, small_marks, sizeof small_marks), memcpy(m->states, small_states, sizeof small_states);
}

static void give(const image *m)
{
    memcpy(small_marks, m->marks, sizeof small_marks), memcpy(small_states, m->states, sizeof small_states);
}

/* kept_open on what is in memory: `value` or, if may, the one before. */
static int small_open(uint32_t value, int may)
{
    const int i = kept_open(small_marks, small_states, (int)sizeof *small_states, SMALL);
    const int found = i >= 0 && (small_is(&small_states[i], value) || (may && small_is(&small_states[i], value - 1)));
    expect(found, "a small state is lost");
    return i;
}

/* Every cut of the recovery from what is in memory. */
static void recover(uint32_t value, int may, int high_first)
{
    static write w[sizeof trace.w / sizeof *trace.w];
    image cut;
    take(&cut);
    trace_begin(high_first);
    small_open(value, may);
    trace_end();
    const int count = trace.count;
    memcpy(w, trace.w, (size_t)count * sizeof *w);
    for (int k = 0; k < count; k++) {
        for (int variant = 0; variant < TORN; variant++) {
            give(&cut);
            for (int j = 0; j < k; j++)
                *word_at(w[j].at) = w[j].new;
            *word_at(w[k].at) = torn(&w[k], variant);
            small_open(value, may);
            again++;
        }
    }
}

/* A state is changed to `value`, word by word, and saved; cut at every write. */
static int small_save(int i, uint32_t value, int high_first)
{
    static write w[sizeof trace.w / sizeof *trace.w];
    image was, is;
    take(&was);
    trace_begin(high_first);
    small *s = &small_states[i];
    const uint32_t first = value * UINT32_C(2654435761);
    s->value = value;
    for (uint32_t k = 0; k < 11; k++)
        *(volatile uint32_t *)&s->fill[k] = first + k;
    const int next = kept_save(small_marks, small_states, (int)sizeof *small_states, i, SMALL);
    trace_end();
    take(&is);
    const int count = trace.count;
    int sealed = 0;
    memcpy(w, trace.w, (size_t)count * sizeof *w);
    expect(count >= 12 + 6, "too few writes seen");
    for (int k = 0; k < count; k++) {
        for (int variant = 0; variant < TORN; variant++) {
            give(&was);
            for (int j = 0; j < k; j++)
                *word_at(w[j].at) = w[j].new;
            *word_at(w[k].at) = torn(&w[k], variant);
            recover(value, !sealed, high_first);
            cuts++;
        }
        give(&was);
        for (int j = 0; j <= k; j++)
            *word_at(w[j].at) = w[j].new;
        sealed = small_marks[i].number == is.marks[i].number && small_marks[i].sum == is.marks[i].sum;
    }
    expect(sealed, "not saved");
    give(&is);
    return next;
}

static void test_small(void)
{
    int i = 0;
    trace.begin[0] = (unsigned char *)small_marks, trace.size[0] = sizeof small_marks;
    trace.begin[1] = (unsigned char *)small_states, trace.size[1] = sizeof small_states;
    expect(kept_open(small_marks, small_states, (int)sizeof *small_states, SMALL) == -1, "a state where there is none");
    for (uint32_t value = 1; value <= 260; value++) {
        if (value > 2 && value < 253) { /* numbers of a save with one byte, then with two */
            small_fill(&small_states[i], value);
            i = kept_save(small_marks, small_states, (int)sizeof *small_states, i, SMALL);
        } else if (value == 1) {
            small_fill(&small_states[i], value); /* before the first save there is nothing to lose */
            i = kept_save(small_marks, small_states, (int)sizeof *small_states, i, SMALL);
        } else i = small_save(i, value, (int)(value & 1));
    }
    expect(kept_open(small_marks, small_states, (int)sizeof *small_states, SMALL + 1) == -1, "a state of another program");
}

/* ---- adapt.c ---- */

static struct { kept_mark marks[2]; memory copies[2]; } now;
static memory old_state, new_state;

static void test_adapt(void)
{
    int copy = 0, saves = 0;
    uint32_t found_new = 0, found_old = 0;
    start(&copies[0]);
    for (int t = 0; t < 2000; t++) {
        memory *m = &copies[copy];
        chain_state x;
        const int saving = turn.phase == SAVE && ++saves == 3;
        if (m->tick % PUSH == 0) move(&m->machine, &m->seed), m->samples = 0;
        rods_step(&m->machine, after, NULL, TICK);
        rods_read(&m->machine, &x);
        if (saving) {
            old_state = copies[1 - copy];
            memcpy(now.marks, marks, sizeof marks), memcpy(now.copies, copies, sizeof copies);
            trace.begin[0] = (unsigned char *)marks, trace.size[0] = sizeof marks;
            trace.begin[1] = (unsigned char *)copies, trace.size[1] = sizeof copies;
            m->tick++, m->samples++; /* as tick() does before it saves */
            memmove(m->last + 1, m->last, 3 * sizeof *m->last);
            m->last[0] = x;
            memcpy(&now.copies[copy], m, sizeof *m);
            trace_begin(0);
            kept_save(marks, copies, (int)sizeof *copies, copy, origin);
            trace_end();
            new_state = copies[copy];
            break;
        }
        copy = tick(copy, &x);
    }
    const int count = trace.count;
    expect(saves == 3 && count > (int)sizeof(memory) / 4, "adapt.c has not saved");
    for (int k = 0; k < count; k++) {
        const write *w = &trace.w[k];
        for (int variant = k < 6 ? 0 : 19; variant < (k < 6 ? TORN : 21); variant++) {
            memcpy(marks, now.marks, sizeof marks), memcpy(copies, now.copies, sizeof copies);
            *word_at(w->at) = torn(w, variant);
            const int i = kept_open(marks, copies, (int)sizeof *copies, origin);
            const int is_new = i >= 0 && memcmp(&copies[i], &new_state, sizeof new_state) == 0;
            const int is_old = i >= 0 && memcmp(&copies[i], &old_state, sizeof old_state) == 0;
            expect(is_new || (is_old && k < 4), "an adaptation is lost");
            if (is_new) found_new++;
            else found_old++;
        }
        /* the word is there */
        memcpy(marks, now.marks, sizeof marks), memcpy(copies, now.copies, sizeof copies);
        *word_at(w->at) = w->new;
        memcpy(now.marks, marks, sizeof marks), memcpy(now.copies, copies, sizeof copies);
    }
    put_integer((uint32_t)sizeof(memory), 0);
    put_text(" bytes of adapt.c: ");
    put_integer((uint32_t)count, 0);
    put_text(" words of a save, ");
    put_integer(found_old + found_new, 0);
    put_text(" cuts, found the state before ");
    put_integer(found_old, 0);
    put_text(", the new one ");
    put_integer(found_new, 0);
    put_text("\n");
}

int main(void)
{
    test_small();
    put_text("small state: power cuts of a save ");
    put_integer(cuts, 0);
    put_text(", of the recovery from one ");
    put_integer(again, 0);
    put_text("\n");
    test_adapt();
    put_integer((uint32_t)bad, 0);
    put_text(" lost\n");
    return bad > 0;
}
