/* SPDX-License-Identifier: MIT */
/* rim_player: plays cf/toy.rec (replay/recording.h) to rim_app over the software bus, prints what
 * comes back, tries the table and the commands, and ends cFE. Its lines begin with 'player'. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "cfe_tbl_fcncodes.h"
#include "cfe_tbl_msg.h"
#include "cfe_tbl_msgids.h"

#include "base/bytes.h"
#include "replay/recording.h"
#include "rim_app_msg.h"

#define MOST_BYTES 1000000u
#define PATIENCE_MS 20000
#define TABLE "RIM_APP.Image"

void RIM_PLAYER_Main(void);

static CFE_SB_PipeId_t Pipe;
static RIM_APP_HkTlm_t Hk; /* the newest */
static _Alignas(8) unsigned char Recording[MOST_BYTES];

static void Fail(const char *Why) {
  printf("player failed: %s\n", Why);
  fflush(stdout);
  _exit(3);
}

static void PrintAlarm(const rim_alarm *A) {
  printf("player record %lu %u %u %u %u %.17g %.17g %.17g %.17g\n", (unsigned long)A->seq, A->state,
         A->level, A->kind, A->channel[0], A->t_s, A->since_s, A->shift[0], A->shift_sd[0]);
}

static void Send(CFE_MSG_Message_t *Message) {
  CFE_MSG_GenerateChecksum(Message);
  if (CFE_SB_TransmitMsg(Message, true) != CFE_SUCCESS)
    Fail("a message was not taken");
}

static void Command(CFE_MSG_Message_t *Message, uint32 Mid, CFE_MSG_FcnCode_t Code, size_t Size) {
  CFE_MSG_Init(Message, CFE_SB_ValueToMsgId(Mid), Size);
  CFE_MSG_SetFcnCode(Message, Code);
  Send(Message);
}

/* Asks for housekeeping, and takes everything up to it: what came before was worked off. */
static void Settle(void) {
  static RIM_APP_NoArgsCmd_t Ask;
  CFE_MSG_Init(CFE_MSG_PTR(Ask.CommandHeader), CFE_SB_ValueToMsgId(RIM_APP_SEND_HK_MID),
               sizeof Ask);
  Send(CFE_MSG_PTR(Ask.CommandHeader));
  for (;;) {
    CFE_SB_Buffer_t *Buffer = NULL;
    CFE_SB_MsgId_t Id = CFE_SB_INVALID_MSG_ID;
    if (CFE_SB_ReceiveBuffer(&Buffer, Pipe, PATIENCE_MS) != CFE_SUCCESS)
      Fail("no housekeeping");
    CFE_MSG_GetMsgId(&Buffer->Msg, &Id);
    if (CFE_SB_MsgIdToValue(Id) == RIM_APP_ALARM_TLM_MID) {
      PrintAlarm(&((RIM_APP_AlarmTlm_t *)Buffer)->Record);
    } else {
      memcpy(&Hk, Buffer, sizeof Hk);
      return;
    }
  }
}

static void PrintHk(const char *When) {
  const RIM_APP_HkTlm_Payload_t *P = &Hk.Payload;
  Settle();
  printf("player %s: rows %lu refused %lu records %lu level %u commands %u errors %u "
         "images %lu refused_images %lu loaded %u digest %08lx%08lx\n",
         When, (unsigned long)P->Rows, (unsigned long)P->Refused, (unsigned long)P->Records,
         P->Level, P->CommandCounter, P->CommandErrorCounter, (unsigned long)P->ImagesOpened,
         (unsigned long)P->ImagesRefused, P->ImageLoaded, (unsigned long)(P->Digest >> 32),
         (unsigned long)(P->Digest & 0xffffffffu));
}

static void Play(void) {
  static RIM_APP_Row_t Row;
  const uint32 ImageBytes = rimi_le_u32(Recording, 2), Rows = rimi_le_u32(Recording, 3);
  const uint32 Doubles = rimi_le_u32(Recording, 4);
  const unsigned char *Data = Recording + RECORDING_HEADER_BYTES + ((ImageBytes + 7u) & ~7u);
  CFE_MSG_Init(CFE_MSG_PTR(Row.TelemetryHeader), CFE_SB_ValueToMsgId(RIM_APP_ROW_MID), sizeof Row);
  Row.Count = Doubles - 1u;
  for (uint32 R = 0; R < Rows; R++) {
    Row.TimeS = rimi_le_f64(Data, (size_t)R * Doubles);
    for (uint32 I = 0; I < Row.Count; I++)
      Row.Value[I] = rimi_le_f64(Data, (size_t)R * Doubles + 1u + I);
    CFE_SB_TransmitMsg(CFE_MSG_PTR(Row.TelemetryHeader), true);
    if (R % 8u == 7u)
      Settle();
  }
  PrintHk("played");
  Row.Count++;
  CFE_SB_TransmitMsg(CFE_MSG_PTR(Row.TelemetryHeader), true);
  Row.Count = 4000000000u;
  CFE_SB_TransmitMsg(CFE_MSG_PTR(Row.TelemetryHeader), true);
  PrintHk("wrong rows");
}

/* Rows of a source whose clock began again, so often that rim_app never waits in vain: all of
 * them are refused, and soon nothing is known. At most half a minute. */
static void PlayOldRows(void) {
  static RIM_APP_Row_t Row;
  CFE_MSG_Init(CFE_MSG_PTR(Row.TelemetryHeader), CFE_SB_ValueToMsgId(RIM_APP_ROW_MID), sizeof Row);
  Row.Count = rimi_le_u32(Recording, 4) - 1u;
  for (uint32 I = 0; I < 30000u / (RIM_APP_IDLE_MS / 4u); I++) {
    CFE_SB_TransmitMsg(CFE_MSG_PTR(Row.TelemetryHeader), true);
    OS_TaskDelay(RIM_APP_IDLE_MS / 4u);
    Settle();
    if (Hk.Payload.Level == RIM_LEVEL_STALE)
      break;
  }
  PrintHk("old rows");
}

static void ClearAlarm(uint32 Sequence, uint32 ModelId) {
  static RIM_APP_AlarmCmd_t Cmd;
  CFE_MSG_Init(CFE_MSG_PTR(Cmd.CommandHeader), CFE_SB_ValueToMsgId(RIM_APP_CMD_MID), sizeof Cmd);
  CFE_MSG_SetFcnCode(CFE_MSG_PTR(Cmd.CommandHeader), RIM_APP_CLEAR_CC);
  Cmd.Sequence = Sequence;
  Cmd.ModelId = ModelId;
  Send(CFE_MSG_PTR(Cmd.CommandHeader));
}

static void TryCommands(uint32 Sequence, uint32 ModelId) {
  static RIM_APP_NoArgsCmd_t Plain;
  Command(CFE_MSG_PTR(Plain.CommandHeader), RIM_APP_CMD_MID, RIM_APP_NOOP_CC, sizeof Plain);
  Command(CFE_MSG_PTR(Plain.CommandHeader), RIM_APP_CMD_MID, RIM_APP_CLEAR_CC, sizeof Plain);
  Command(CFE_MSG_PTR(Plain.CommandHeader), RIM_APP_CMD_MID, 77, sizeof Plain);
  PrintHk("commands");
  ClearAlarm(Sequence + 1u, ModelId);
  PrintHk("clear another");
  ClearAlarm(Sequence, ModelId);
  PrintHk("clear");
}

/* cFE's table services work in a task of their own and answer nobody: each gets its time. */
static void TableCommand(CFE_MSG_Message_t *Message, CFE_MSG_FcnCode_t Code) {
  CFE_MSG_SetFcnCode(Message, Code);
  Send(Message);
  OS_TaskDelay(300);
}

/* Loads a file of a table and lets it be validated and activated, as an operator would. */
static void LoadTable(const char *File) {
  static CFE_TBL_AbortLoadCmd_t Abort;
  static CFE_TBL_LoadCmd_t Load;
  static CFE_TBL_ValidateCmd_t Validate;
  static CFE_TBL_ActivateCmd_t Activate;
  const CFE_SB_MsgId_t Id = CFE_SB_ValueToMsgId(CFE_TBL_CMD_MID);
  CFE_MSG_Init(CFE_MSG_PTR(Abort.CommandHeader), Id, sizeof Abort);
  CFE_MSG_Init(CFE_MSG_PTR(Load.CommandHeader), Id, sizeof Load);
  CFE_MSG_Init(CFE_MSG_PTR(Validate.CommandHeader), Id, sizeof Validate);
  CFE_MSG_Init(CFE_MSG_PTR(Activate.CommandHeader), Id, sizeof Activate);
  Validate.Payload.ActiveTableFlag = CFE_TBL_BufferSelect_INACTIVE;
  snprintf(Abort.Payload.TableName, sizeof Abort.Payload.TableName, TABLE);
  snprintf(Load.Payload.LoadFilename, sizeof Load.Payload.LoadFilename, "%s", File);
  snprintf(Validate.Payload.TableName, sizeof Validate.Payload.TableName, TABLE);
  snprintf(Activate.Payload.TableName, sizeof Activate.Payload.TableName, TABLE);
  TableCommand(CFE_MSG_PTR(Abort.CommandHeader), CFE_TBL_ABORT_LOAD_CC);
  TableCommand(CFE_MSG_PTR(Load.CommandHeader), CFE_TBL_LOAD_CC);
  TableCommand(CFE_MSG_PTR(Validate.CommandHeader), CFE_TBL_VALIDATE_CC);
  Settle(); /* rim_app manages its table: the validation */
  TableCommand(CFE_MSG_PTR(Activate.CommandHeader), CFE_TBL_ACTIVATE_CC);
  Settle(); /* the exchange */
}

void RIM_PLAYER_Main(void) {
  FILE *File = fopen("cf/toy.rec", "rb");
  if (File == NULL || fread(Recording, 1, sizeof Recording, File) <= RECORDING_HEADER_BYTES)
    Fail("no cf/toy.rec");
  CFE_ES_WaitForStartupSync(10000);
  if (CFE_EVS_Register(NULL, 0, CFE_EVS_EventFilter_BINARY) != CFE_SUCCESS ||
      CFE_SB_CreatePipe(&Pipe, 32, "RIM_PLAYER") != CFE_SUCCESS ||
      CFE_SB_SubscribeEx(CFE_SB_ValueToMsgId(RIM_APP_ALARM_TLM_MID), Pipe, CFE_SB_DEFAULT_QOS,
                         24) != CFE_SUCCESS ||
      CFE_SB_Subscribe(CFE_SB_ValueToMsgId(RIM_APP_HK_TLM_MID), Pipe) != CFE_SUCCESS)
    Fail("no pipe");
  Play();
  TryCommands(Hk.Payload.Records, Hk.Payload.ModelId);
  LoadTable("/cf/rim_bad.tbl");
  PrintHk("damaged table");
  LoadTable("/cf/rim_image.tbl");
  PrintHk("new table");
  Play();
  PlayOldRows();
  printf("player done\n");
  fflush(stdout);
  _exit(0);
}
