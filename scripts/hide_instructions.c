/* Hides instruction sets from a program, so that code which chooses by CPUID at run time takes its lower path.
 *
 * Preloaded (LD_PRELOAD), it lets CPUID fault (arch_prctl, Linux on x86-64), answers the instruction itself and clears the
 * bits of AVX-512, and with HIDE=avx2 also those of AVX, AVX2 and FMA. Threads and children inherit it. Nothing in the core
 * knows of it. glibc has chosen its functions before and is told by GLIBC_TUNABLES. A program that installs a handler of
 * SIGSEGV of its own (Python's faulthandler) takes ours away: do not let it.
 */
#define _GNU_SOURCE
#include <cpuid.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

enum { ARCH_SET_CPUID = 0x1012 };

static int hide_avx2;

static unsigned without(unsigned word, const int *bits, int count) {
    for (int k = 0; k < count; k++) word &= ~(1u << bits[k]);
    return word;
}

/* Bits as in Intel's manual, volume 2, table of CPUID. */
static void hide(unsigned leaf, unsigned subleaf, unsigned r[4]) {
    static const int avx512_ebx[] = {16, 17, 21, 26, 27, 28, 30, 31}, avx512_ecx[] = {1, 6, 11, 12, 14}, avx512_edx[] = {2, 3, 8, 23};
    static const int fma_avx_f16c[] = {12, 28, 29}, avx2_ebx[] = {5}, vector_aes[] = {9, 10}, avx_vnni[] = {4, 5};
    if (leaf == 7 && subleaf == 0) {
        r[1] = without(r[1], avx512_ebx, 8), r[2] = without(r[2], avx512_ecx, 5), r[3] = without(r[3], avx512_edx, 4);
        if (hide_avx2) r[1] = without(r[1], avx2_ebx, 1), r[2] = without(r[2], vector_aes, 2);
    }
    if (leaf == 7 && subleaf == 1) r[0] = without(r[0], avx_vnni, 2);
    if (leaf == 1 && hide_avx2) r[2] = without(r[2], fma_avx_f16c, 3);
}

static void answer(int signal_number, siginfo_t *info, void *context) {
    greg_t *g = ((ucontext_t *)context)->uc_mcontext.gregs;
    const unsigned char *code = (const unsigned char *)g[REG_RIP];
    if (info->si_code != SI_KERNEL || code[0] != 0x0f || code[1] != 0xa2) { /* a fault of the program itself */
        signal(signal_number, SIG_DFL);
        return;
    }
    unsigned leaf = (unsigned)g[REG_RAX], subleaf = (unsigned)g[REG_RCX], r[4];
    syscall(SYS_arch_prctl, ARCH_SET_CPUID, 1);
    __cpuid_count(leaf, subleaf, r[0], r[1], r[2], r[3]);
    syscall(SYS_arch_prctl, ARCH_SET_CPUID, 0);
    hide(leaf, subleaf, r);
    g[REG_RAX] = r[0], g[REG_RBX] = r[1], g[REG_RCX] = r[2], g[REG_RDX] = r[3];
    g[REG_RIP] += 2;
}

__attribute__((constructor)) static void begin(void) {
    const char *which = getenv("HIDE");
    hide_avx2 = which != NULL && strcmp(which, "avx2") == 0;
    struct sigaction action = {.sa_sigaction = answer, .sa_flags = SA_SIGINFO | SA_NODEFER | SA_ONSTACK};
    sigaction(SIGSEGV, &action, NULL);
    if (syscall(SYS_arch_prctl, ARCH_SET_CPUID, 0) != 0) _exit(77); /* the machine cannot: a test skips */
}
