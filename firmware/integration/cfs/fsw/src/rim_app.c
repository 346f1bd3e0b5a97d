/* SPDX-License-Identifier: MIT */
/* rim_app: the monitor as an application of NASA's core Flight System. One pipe carries rows,
 * commands and requests for housekeeping; the flight image is a table. */
#include <string.h>

#include "rim/version.h"
#include "rim_app_msg.h"
#include "rim_watch.h"

typedef struct {
  CFE_SB_PipeId_t Pipe;
  CFE_TBL_Handle_t Image;
  RIM_APP_HkTlm_t Hk;
  RIM_APP_AlarmTlm_t Alarm;
  rim_watch Watch;
} RIM_APP_Data_t;

static RIM_APP_Data_t Data;
static _Alignas(8) unsigned char Memory[RIM_APP_MONITOR_BYTES];

void RIM_APP_Main(void);

static bool IsAlarm(const rim_alarm *Record) {
  return Record->state == RIM_ALARM_RAISED || Record->state == RIM_ALARM_UPDATED;
}

/* Every record: an event for people, a packet for programs. */
static void SendRecord(void *User, const rim_alarm *Record) {
  char Words[CFE_MISSION_EVS_MAX_MESSAGE_LENGTH];
  (void)User;
  (void)rim_watch_words(&Data.Watch, Record, Words, sizeof Words);
  if (Record->level == RIM_LEVEL_STALE)
    CFE_EVS_SendEvent(RIM_APP_STALE_ERR_EID, CFE_EVS_EventType_ERROR, "RIM: %s", Words);
  else if (IsAlarm(Record))
    CFE_EVS_SendEvent(RIM_APP_ALARM_ERR_EID, CFE_EVS_EventType_ERROR, "RIM: %s", Words);
  else
    CFE_EVS_SendEvent(RIM_APP_ALARM_INF_EID, CFE_EVS_EventType_INFORMATION, "RIM: %s", Words);
  Data.Alarm.Record = *Record;
  CFE_SB_TimeStampMsg(CFE_MSG_PTR(Data.Alarm.TelemetryHeader));
  CFE_SB_TransmitMsg(CFE_MSG_PTR(Data.Alarm.TelemetryHeader), true);
}

/* cFE calls it with every image that is loaded, before it can become active: whole, undamaged, and
 * small enough for the memory that this application has. */
static int32 ValidateImage(void *Table) {
  rim_image View;
  size_t Bytes = 0;
  rim_status Status = rim_image_open(&View, Table, RIM_APP_IMAGE_BYTES);
  if (Status == RIM_OK)
    Status = rim_monitor_size(Table, RIM_APP_IMAGE_BYTES, &Bytes);
  if (Status == RIM_OK && Bytes > sizeof Memory)
    Status = RIM_E_CAPACITY;
  Data.Hk.Payload.ImageStatus = (int32)Status;
  if (Status == RIM_OK)
    return CFE_SUCCESS;
  Data.Hk.Payload.ImagesRefused++;
  CFE_EVS_SendEvent(RIM_APP_IMAGE_ERR_EID, CFE_EVS_EventType_ERROR, "RIM: image refused: %s",
                    rim_status_text(Status));
  return CFE_STATUS_VALIDATION_FAILURE;
}

static void OpenImage(void *Table) {
  const rim_status Status = rim_watch_open(&Data.Watch, Memory, sizeof Memory, Table,
                                           RIM_APP_IMAGE_BYTES, SendRecord, NULL);
  Data.Hk.Payload.ImageLoaded = Status == RIM_OK;
  if (Status != RIM_OK) {
    CFE_EVS_SendEvent(RIM_APP_IMAGE_ERR_EID, CFE_EVS_EventType_ERROR, "RIM: image not opened: %s",
                      rim_status_text(Status));
    return;
  }
  Data.Hk.Payload.ImagesOpened++;
  CFE_EVS_SendEvent(RIM_APP_IMAGE_INF_EID, CFE_EVS_EventType_INFORMATION,
                    "RIM: image %08lx opened, rows of %lu values",
                    (unsigned long)Data.Watch.image.model_id, (unsigned long)Data.Watch.values);
}

/* Lets cFE validate and exchange the table, and begins anew with another image. */
static void ManageImage(void) {
  void *Table = NULL;
  CFE_TBL_ReleaseAddress(Data.Image);
  CFE_TBL_Manage(Data.Image);
  const CFE_Status_t Status = CFE_TBL_GetAddress(&Table, Data.Image);
  if (Status == CFE_TBL_INFO_UPDATED || (Status == CFE_SUCCESS && !Data.Hk.Payload.ImageLoaded))
    OpenImage(Table);
}

static void SendHk(void) {
  RIM_APP_HkTlm_Payload_t *Hk = &Data.Hk.Payload;
  ManageImage();
  Hk->Level = Data.Watch.monitor != NULL ? Data.Watch.level : RIM_LEVEL_STALE;
  Hk->ModelId = Data.Watch.image.model_id;
  Hk->Rows = Data.Watch.rows;
  Hk->Refused = Data.Watch.refused;
  Hk->Records = Data.Watch.records;
  Hk->Digest = Data.Watch.digest;
  Hk->RowHealth = rim_monitor_get_health(Data.Watch.monitor).rows;
  CFE_SB_TimeStampMsg(CFE_MSG_PTR(Data.Hk.TelemetryHeader));
  CFE_SB_TransmitMsg(CFE_MSG_PTR(Data.Hk.TelemetryHeader), true);
}

static void TakeRow(const CFE_SB_Buffer_t *Buffer, size_t Size) {
  const RIM_APP_Row_t *Row = (const RIM_APP_Row_t *)Buffer;
  if (Size != sizeof *Row || Row->Count > RIM_APP_MAX_VALUES ||
      rim_watch_row(&Data.Watch, Row->TimeS, Row->Value, Row->Count, NULL) == RIM_E_ARGUMENT)
    Data.Watch.refused++; /* rim_watch_row counts another number of values itself */
}

static void Count(bool Obeyed) {
  if (Obeyed)
    Data.Hk.Payload.CommandCounter++;
  else
    Data.Hk.Payload.CommandErrorCounter++;
}

static bool ObeyAlarmCommand(const CFE_SB_Buffer_t *Buffer, CFE_MSG_FcnCode_t Code) {
  const RIM_APP_AlarmCmd_t *Cmd = (const RIM_APP_AlarmCmd_t *)Buffer;
  const rim_command Command = {.sequence = Cmd->Sequence,
                               .model_id = Cmd->ModelId,
                               .command = Code == RIM_APP_CLEAR_CC ? RIM_COMMAND_CLEAR
                                                                   : RIM_COMMAND_ACKNOWLEDGE};
  const rim_status Status = rim_watch_command(&Data.Watch, &Command);
  if (Status == RIM_OK)
    CFE_EVS_SendEvent(RIM_APP_COMMAND_INF_EID, CFE_EVS_EventType_INFORMATION,
                      "RIM: command %u on record %lu", (unsigned)Code,
                      (unsigned long)Cmd->Sequence);
  else
    CFE_EVS_SendEvent(RIM_APP_COMMAND_ERR_EID, CFE_EVS_EventType_ERROR,
                      "RIM: command %u on record %lu refused: %s", (unsigned)Code,
                      (unsigned long)Cmd->Sequence, rim_status_text(Status));
  return Status == RIM_OK;
}

static void TakeCommand(const CFE_SB_Buffer_t *Buffer, size_t Size) {
  CFE_MSG_FcnCode_t Code = 0;
  CFE_MSG_GetFcnCode(&Buffer->Msg, &Code);
  const bool HasArgs = Code == RIM_APP_ACKNOWLEDGE_CC || Code == RIM_APP_CLEAR_CC;
  const size_t Wanted = HasArgs ? sizeof(RIM_APP_AlarmCmd_t) : sizeof(RIM_APP_NoArgsCmd_t);
  if (Size != Wanted || Code > RIM_APP_CLEAR_CC) {
    CFE_EVS_SendEvent(RIM_APP_COMMAND_ERR_EID, CFE_EVS_EventType_ERROR,
                      "RIM: no command: code %u with %lu bytes", (unsigned)Code,
                      (unsigned long)Size);
    Count(false);
  } else if (HasArgs) {
    Count(ObeyAlarmCommand(Buffer, Code));
  } else if (Code == RIM_APP_RESET_COUNTERS_CC) {
    Data.Hk.Payload.CommandCounter = 0;
    Data.Hk.Payload.CommandErrorCounter = 0;
    CFE_EVS_SendEvent(RIM_APP_RESET_INF_EID, CFE_EVS_EventType_DEBUG, "RIM: counters reset");
  } else {
    Count(true);
    CFE_EVS_SendEvent(RIM_APP_NOOP_INF_EID, CFE_EVS_EventType_INFORMATION, "RIM: no operation");
  }
}

static void TakeMessage(const CFE_SB_Buffer_t *Buffer) {
  CFE_SB_MsgId_t Id = CFE_SB_INVALID_MSG_ID;
  CFE_MSG_Size_t Size = 0;
  CFE_MSG_GetMsgId(&Buffer->Msg, &Id);
  CFE_MSG_GetSize(&Buffer->Msg, &Size);
  switch (CFE_SB_MsgIdToValue(Id)) {
  case RIM_APP_ROW_MID:
    TakeRow(Buffer, Size);
    break;
  case RIM_APP_CMD_MID:
    TakeCommand(Buffer, Size);
    break;
  case RIM_APP_SEND_HK_MID:
    SendHk();
    break;
  default:
    break;
  }
}

/* After every message and while none comes: commands, housekeeping and rows that are refused do not
 * end a silence. */
static void TellTime(void) {
  const CFE_TIME_SysTime_t Now = CFE_TIME_GetMET();
  rim_watch_tick(&Data.Watch, Now.Seconds + 1e-6 * CFE_TIME_Sub2MicroSecs(Now.Subseconds));
}

static CFE_Status_t Init(void) {
  memset(&Data, 0, sizeof Data);
  CFE_Status_t Status = CFE_EVS_Register(NULL, 0, CFE_EVS_EventFilter_BINARY);
  CFE_MSG_Init(CFE_MSG_PTR(Data.Hk.TelemetryHeader), CFE_SB_ValueToMsgId(RIM_APP_HK_TLM_MID),
               sizeof Data.Hk);
  CFE_MSG_Init(CFE_MSG_PTR(Data.Alarm.TelemetryHeader), CFE_SB_ValueToMsgId(RIM_APP_ALARM_TLM_MID),
               sizeof Data.Alarm);
  if (Status == CFE_SUCCESS)
    Status = CFE_SB_CreatePipe(&Data.Pipe, RIM_APP_PIPE_DEPTH, "RIM_APP");
  if (Status == CFE_SUCCESS)
    Status = CFE_SB_SubscribeEx(CFE_SB_ValueToMsgId(RIM_APP_ROW_MID), Data.Pipe, CFE_SB_DEFAULT_QOS,
                                RIM_APP_PIPE_DEPTH);
  if (Status == CFE_SUCCESS)
    Status = CFE_SB_Subscribe(CFE_SB_ValueToMsgId(RIM_APP_CMD_MID), Data.Pipe);
  if (Status == CFE_SUCCESS)
    Status = CFE_SB_Subscribe(CFE_SB_ValueToMsgId(RIM_APP_SEND_HK_MID), Data.Pipe);
  if (Status == CFE_SUCCESS)
    Status = CFE_TBL_Register(&Data.Image, "Image", RIM_APP_IMAGE_BYTES, CFE_TBL_OPT_SNGL_BUFFER,
                              ValidateImage);
  if (Status != CFE_SUCCESS)
    return Status;
  /* Without an image it runs and says STALE: another one can be loaded. */
  (void)CFE_TBL_Load(Data.Image, CFE_TBL_SRC_FILE, RIM_APP_TABLE_FILE);
  ManageImage();
  CFE_EVS_SendEvent(RIM_APP_STARTED_INF_EID, CFE_EVS_EventType_INFORMATION,
                    "RIM: started, librim %d", rim_version());
  return CFE_SUCCESS;
}

void RIM_APP_Main(void) {
  uint32 RunStatus = CFE_ES_RunStatus_APP_RUN;
  CFE_SB_Buffer_t *Buffer = NULL;
  if (Init() != CFE_SUCCESS)
    RunStatus = CFE_ES_RunStatus_APP_ERROR;
  while (CFE_ES_RunLoop(&RunStatus)) {
    const CFE_Status_t Status = CFE_SB_ReceiveBuffer(&Buffer, Data.Pipe, RIM_APP_IDLE_MS);
    if (Status == CFE_SUCCESS) {
      TakeMessage(Buffer);
      TellTime();
    } else if (Status == CFE_SB_TIME_OUT) {
      TellTime();
    } else {
      CFE_EVS_SendEvent(RIM_APP_PIPE_ERR_EID, CFE_EVS_EventType_ERROR, "RIM: pipe error 0x%08lx",
                        (unsigned long)Status);
      RunStatus = CFE_ES_RunStatus_APP_ERROR;
    }
  }
  CFE_ES_ExitApp(RunStatus);
}
